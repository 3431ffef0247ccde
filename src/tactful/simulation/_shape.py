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

    def gap(self, q: Array, start_m: Array, end_m: Array, radius_m: float) -> Array:
        """Return the distance of every capsule to another one, negative where they overlap (p,) [m]."""
        start, end, radius = self.at(q)
        share = np.linspace(0, 1, 9)[:, None, None]
        points = start_m + share * (end_m - start_m)  # (9, 1, 3) along the other one's axis
        axis = end - start  # (p, 3)
        square = np.maximum(np.einsum("pi,pi->p", axis, axis), 1e-18)
        along = np.clip(np.einsum("kpi,pi->kp", points - start, axis) / square, 0, 1)
        distance = np.linalg.norm(points - start - along[..., None] * axis, axis=2)  # (9, p)
        return np.asarray(distance.min(axis=0) - radius - radius_m)
