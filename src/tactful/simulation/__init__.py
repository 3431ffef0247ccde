"""A work cell in MuJoCo: an arm, things in its way, hands on it, sensors, and the truth about every contact.

Needs the extra `mujoco`.
"""

from tactful.simulation._config import CellConfig, SensorConfig
from tactful.simulation._episode import Episode, collision_and_help
from tactful.simulation._fixtures import Box, Fixture, Table
from tactful.simulation._hands import Guide, Hand, Push
from tactful.simulation._truth import TrueContact
from tactful.simulation._work_cell import Sample, WorkCell

__all__ = [
    "Box",
    "CellConfig",
    "Episode",
    "Fixture",
    "Guide",
    "Hand",
    "Push",
    "Sample",
    "SensorConfig",
    "Table",
    "TrueContact",
    "WorkCell",
    "collision_and_help",
]
