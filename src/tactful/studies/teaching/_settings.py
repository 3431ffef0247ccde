"""The settings of the monitors, found as a user finds them."""

from __future__ import annotations

from tactful.calibration import calibrate
from tactful.monitor import MonitorConfig
from tactful.simulation import PEG, draw_plan, simulate
from tactful.simulation._spec import SensorPreset

_EPISODES = 8


def calibrated(sensors: SensorPreset, seed: int, *, arm: int = 0) -> MonitorConfig:
    """Return the settings of a monitor, calibrated on a minute of free motion of the arm.

    Args:
        sensors: preset of the arm's sensors.
        seed: what the motions are drawn from.
        arm: which arm.
    """
    plan = draw_plan(_EPISODES, seed, kinds=("free",), sensors=sensors, arm=arm)
    return calibrate([simulate(spec) for spec in plan], MonitorConfig(robot=PEG)).config
