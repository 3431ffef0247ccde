"""Monitor an arm while it moves, and stop it at a collision."""

import numpy as np

from tactful import Monitor, MonitorConfig
from tactful.simulation import collision_and_help

episode = collision_and_help(np.random.default_rng(2))
config = MonitorConfig(noise={"velocity_rad_s": 0.001, "torque_nm": 0.05, "model_nm": 0.2})
monitor = Monitor(episode.cell.robot, config)
monitor.warm_up()  # compiles, so that the loop does not wait
for t, q, dq, tau in episode.run():  # your robot's 1 kHz loop
    event = monitor.update(t, q, dq, tau)
    if event is not None and event.kind == "collision":
        print(f"{t:.3f} s: stop, the arm ran into something {1e3 * (t - event.onset_s):.0f} ms ago")
        break
