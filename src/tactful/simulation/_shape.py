"""Where the capsules of an arm are."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from tactful.dynamics import arm_record, kernels, motion_record
from tactful.robots import Robot

Array = NDArray[np.float64]


class Shape:
    """The p capsules of an arm.

    Args:
        robot: the arm.
    """

    def __init__(self, robot: Robot) -> None:
        arm: Any = arm_record(robot)
        motion: Any = motion_record(robot.n)
        self._arm, self._motion = arm[0], motion[0]
        self.link = np.array([capsule.link for capsule in robot.capsules])  # (p,)
        self._ends = np.array([(capsule.p0_m, capsule.p1_m) for capsule in robot.capsules])  # (p, 2, 3)
        self.radius = np.array([capsule.radius_m for capsule in robot.capsules])  # (p,)

    def link_pose(self, q: Array, link: int) -> tuple[Array, Array]:
        """Return the rotation (3, 3) and the origin (3,) [m] of a link in the base."""
        kernels.place(self._arm, self._motion, q)
        return self._motion["R"][link].copy(), self._motion["o"][link].copy()

    def at(self, q: Array) -> tuple[Array, Array, Array]:
        """Return the ends of the axes, twice (p, 3) [m], and the radii (p,) [m] of all capsules."""
        kernels.place(self._arm, self._motion, q)
        R = np.concatenate([self._motion["R"], np.eye(3)[None]])[self.link]  # (p, 3, 3), the base last, as index -1
        o = np.concatenate([self._motion["o"], np.zeros((1, 3))])[self.link]
        start, end = (np.einsum("pij,pj->pi", R, e) + o for e in self._ends.transpose(1, 0, 2))
        return start, end, self.radius

    def along(self, track: Array) -> tuple[Array, Array]:
        """Return the ends of the axes at each of many postures (k, n), twice (k, p, 3) [m]."""
        starts, ends = zip(*(self.at(q)[:2] for q in track), strict=True)
        return np.array(starts), np.array(ends)


def capsule_gap(start: Array, end: Array, radius: Array, start_m: Array, end_m: Array, radius_m: float) -> Array:
    """Return the distance of capsules to one other, negative where they overlap (..., p) [m].

    The other's axis is taken as nine points.

    Args:
        start: one end of the axes (..., p, 3) [m].
        end: the other end (..., p, 3) [m].
        radius: their radii (p,) [m].
        start_m: one end of the other's axis (3,) [m].
        end_m: the other end (3,) [m].
        radius_m: its radius [m].
    """
    points = np.linspace(start_m, end_m, 9)  # (9, 3)
    axis = (end - start)[..., None, :]  # (..., p, 1, 3)
    square = np.maximum((axis * axis).sum(axis=-1), 1e-18)
    away = points - start[..., None, :]  # (..., p, 9, 3)
    along = np.clip((away * axis).sum(axis=-1) / square, 0, 1)  # (..., p, 9)
    distance = np.linalg.norm(away - along[..., None] * axis, axis=-1)
    return np.asarray(distance.min(axis=-1) - radius - radius_m)
