"""A cell without an end: an arm that goes to and fro, an obstacle that can be moved, and hands for every link."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tactful.control import MinimumJerkPath, Pose
from tactful.dynamics import Dynamics
from tactful.robots import Robot
from tactful.simulation._config import SensorConfig
from tactful.simulation._fixtures import Box
from tactful.simulation._hands import Drag
from tactful.simulation._work_cell import WorkCell

Array = NDArray[np.float64]

OBSTACLE = "obstacle"
OBSTACLE_SIZE_M = (0.10, 0.06, 0.60)
_START = np.array([-0.5, 0.1, 0.0, -2.2, 0.0, 2.3, np.pi / 4])
_WAY_M = np.array([0.0, 0.5, 0.0])
_LEG_S, _REST_S = 3.0, 0.5


class Path(Protocol):
    """Where the tip is to be from the time 0 to `end_s`."""

    @property
    def end_s(self) -> float:
        """When its end is reached [s]."""
        ...

    def pose(self, t: float) -> Pose:
        """Return the pose at the time t [s]."""
        ...


class Rounds:
    """Go a path and back again, for ever.

    Args:
        path: the way there, from rest to rest.
        rest_s: how long to rest at each end [s].
    """

    def __init__(self, path: Path, rest_s: float = _REST_S) -> None:
        self.path, self.rest_s = path, rest_s

    def __call__(self, t: float) -> Pose:
        """Return where the tip is to be at the time t [s]."""
        return self.path.pose(self.along(t)[0])

    def along(self, t: float) -> tuple[float, bool]:
        """Return the time on the path [s] at the time t [s], and whether it is the way back."""
        leg_s = self.path.end_s + self.rest_s
        number, since = divmod(t, leg_s)
        there = min(since, self.path.end_s)
        return (self.path.end_s - there, True) if number % 2 else (there, False)


@dataclass(frozen=True, kw_only=True)
class Workshop:
    """A Panda that goes to and fro over a table, and what can meet it.

    Attributes:
        cell: the cell; it keeps no samples.
        plan: where the tip is to be.
        posture: joint positions at the start (n,) [rad].
        hands: a hand for each link, which touches while it has a target.
        in_the_way_m: a place for the obstacle on the way of the tip (3,) [m].
        aside_m: where it stands at first (3,) [m].
    """

    cell: WorkCell
    plan: Rounds
    posture: Array
    hands: tuple[Drag, ...]
    in_the_way_m: Array
    aside_m: Array

    def move(self, centre_m: ArrayLike) -> None:
        """Put the obstacle somewhere (3,) [m]."""
        self.cell.move(OBSTACLE, centre_m)


def workshop(rng: np.random.Generator, *, sensors: SensorConfig | None = None) -> Workshop:
    """Return a workshop, at its start; `rng` is where the noise of the sensors comes from."""
    robot = Robot.load("panda")
    rotation, start = Dynamics(robot).pose(_START)
    path = MinimumJerkPath([(0.0, Pose(rotation, start)), (_LEG_S, Pose(rotation, start + _WAY_M))])
    in_the_way = np.array([start[0], start[1] + 0.6 * _WAY_M[1], OBSTACLE_SIZE_M[2] / 2])
    aside = in_the_way + np.array([0.30, 0.0, 0.0])
    hands = tuple(Drag(link=name, strength_n=50.0) for name in robot.link_names)
    box = Box(name=OBSTACLE, centre_m=tuple(aside), size_m=OBSTACLE_SIZE_M, movable=True)
    arm_rng = np.random.default_rng(0)  # always the same arm
    cell = WorkCell(robot, [box], hands=hands, sensors=sensors, q=_START, rng=rng, arm_rng=arm_rng, keep=False)
    return Workshop(
        cell=cell, plan=Rounds(path), posture=_START.copy(), hands=hands, in_the_way_m=in_the_way, aside_m=aside
    )
