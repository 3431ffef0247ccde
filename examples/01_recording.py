"""Monitor a recording: here a simulated one, with `Recording.read("log.csv")` your own."""

import numpy as np

from tactful import Monitor, MonitorConfig
from tactful.simulation import collision_and_help

episode = collision_and_help(np.random.default_rng(1))
for _ in episode.run():
    pass
recording = episode.cell.recording()

config = MonitorConfig(noise={"velocity_rad_s": 0.001, "torque_nm": 0.05, "model_nm": 0.2})
for event in Monitor(episode.cell.robot, config).run(recording):
    print(f"{event.onset_s:.3f} s: {event.kind}, {event.peak_force_n:.1f} N, because: {event.evidence[-1].text}")
print("true:", *(f"{label.kind} from {label.start_s:.3f} s" for label in recording.labels))
