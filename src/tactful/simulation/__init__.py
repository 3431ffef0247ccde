"""A work cell in MuJoCo: an arm, things in its way, hands on it, sensors, and the truth about every contact.

Needs the extra `mujoco`.
"""

from tactful.simulation._config import CellConfig, NoiseSpectrum, SensorConfig
from tactful.simulation._demonstration import Demonstration
from tactful.simulation._episode import Episode, collision_and_help
from tactful.simulation._fixtures import Bar, Box, Fixture, HoledBox, Table
from tactful.simulation._generate import EpisodeEntry, generate, read_manifest
from tactful.simulation._hands import Drag, Guide, Hand, Hesitation, Lead, Push, Tremor
from tactful.simulation._lesson import Execution, Lesson
from tactful.simulation._operators import OPERATORS, Operator
from tactful.simulation._peg import PEG, mistaken, peg_arm
from tactful.simulation._scene import Scene, draw_scene
from tactful.simulation._simulate import EpisodeResult, run_episode, simulate, spec_of
from tactful.simulation._spec import KINDS, PLACES, EpisodeKind, EpisodeSpec, draw_plan
from tactful.simulation._truth import TrueContact
from tactful.simulation._work_cell import Sample, WorkCell
from tactful.simulation._workshop import OBSTACLE_SIZE_M, Path, Rounds, Workshop, workshop

__all__ = [
    "KINDS",
    "OBSTACLE_SIZE_M",
    "OPERATORS",
    "PEG",
    "PLACES",
    "Bar",
    "Box",
    "CellConfig",
    "Demonstration",
    "Drag",
    "Episode",
    "EpisodeEntry",
    "EpisodeKind",
    "EpisodeResult",
    "EpisodeSpec",
    "Execution",
    "Fixture",
    "Guide",
    "Hand",
    "Hesitation",
    "HoledBox",
    "Lead",
    "Lesson",
    "NoiseSpectrum",
    "Operator",
    "Path",
    "Push",
    "Rounds",
    "Sample",
    "Scene",
    "SensorConfig",
    "Table",
    "Tremor",
    "TrueContact",
    "WorkCell",
    "Workshop",
    "collision_and_help",
    "draw_plan",
    "draw_scene",
    "generate",
    "mistaken",
    "peg_arm",
    "read_manifest",
    "run_episode",
    "simulate",
    "spec_of",
    "workshop",
]
