"""Episodes: a cell, a controller and a reference that belong together."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from tactful.control import CartesianImpedance, MinimumJerkPath, Pose
from tactful.dynamics import Dynamics
from tactful.robots import Robot
from tactful.simulation._config import SensorConfig
from tactful.simulation._fixtures import Box
from tactful.simulation._hands import Push
from tactful.simulation._work_cell import Sample, WorkCell


@dataclass(frozen=True, kw_only=True)
class Episode:
    """An arm in a cell, and what it is to do there.

    Attributes:
        cell: the cell, at its start.
        controller: what commands the arm.
        path: what the tip is to follow.
        duration_s: how long [s].
    """

    cell: WorkCell
    controller: CartesianImpedance
    path: MinimumJerkPath
    duration_s: float

    def run(self) -> Iterator[Sample]:
        """Yield the samples as they come."""
        return self.cell.run(self.controller, self.path.pose, self.duration_s)


def collision_and_help(rng: np.random.Generator, *, sensors: SensorConfig | None = None) -> Episode:
    """Return an episode of 7 s in which a Panda runs into a post, and a hand helps it round.

    The tip is to move 0.5 m along y in 5 s. A post stands in its way; the arm, compliant, leans against it with a force
    that grows as the reference goes on. Then a hand pushes the last link along x until it is past the post. Where
    exactly the post stands, and when, where, how hard and how fast the hand pushes is drawn from `rng`.
    """
    robot = Robot.load("panda")
    q = np.array([-0.5, 0.1, 0.0, -2.2, 0.0, 2.3, np.pi / 4])
    rotation, start = Dynamics(robot).pose(q)
    way = np.array([0.0, 0.5, 0.0])
    path = MinimumJerkPath([(0.5, Pose(rotation, start)), (5.5, Pose(rotation, start + way))])
    face_y = start[1] + rng.uniform(0.20, 0.26)
    post = Box(
        name="post",
        centre_m=(start[0] - 0.02 + rng.uniform(-0.005, 0.005), face_y + 0.02, (start[2] + 0.03) / 2),
        size_m=(0.08, 0.04, start[2] + 0.03),
    )
    angle = rng.uniform(-0.2, 0.2)
    force = rng.uniform(16.0, 20.0)
    hand = Push(
        link="panda_link7",
        point_m=(0.0, 0.0, rng.uniform(0.06, 0.107)),
        start_s=rng.uniform(3.3, 3.6),
        rise_s=rng.uniform(0.10, 0.15),
        hold_s=1.0,
        force_n=(force * np.cos(angle), 0.0, force * np.sin(angle)),
    )
    cell = WorkCell(robot, [post], hands=[hand], sensors=sensors, q=q, rng=rng)
    return Episode(cell=cell, controller=CartesianImpedance(robot, posture=q), path=path, duration_s=7.0)
