"""Give the monitor a classifier of your own: any object with a method `classify`."""

import numpy as np

from tactful import Monitor, MonitorConfig
from tactful.classification import Evidence, Onset, Verdict
from tactful.simulation import collision_and_help


class HowFastItRose:
    """An abrupt force is a collision, a slow one a person: the idea that the kinesthetic paper found wanting."""

    def classify(self, onset: Onset) -> Verdict:
        """Compare the rate of the force with a limit."""
        after = onset.force_n[onset.index :]
        rate = float(np.max(np.linalg.norm(np.diff(after, axis=0), axis=1))) * onset.rate_hz
        kind = "collision" if rate > 500 else "cooperation"
        return Verdict(kind, 0.5, (Evidence("rate", rate, 500.0, f"{kind}: the force changed by {rate:.0f} N/s"),))


episode = collision_and_help(np.random.default_rng(3))
for _ in episode.run():
    pass
config = MonitorConfig(noise={"velocity_rad_s": 0.001, "torque_nm": 0.05, "model_nm": 0.2})
for event in Monitor(episode.cell.robot, config, classifier=HowFastItRose()).run(episode.cell.recording()):
    print(f"{event.onset_s:.3f} s: {event.evidence[-1].text}")
