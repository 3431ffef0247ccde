"""Contacts drawn at random, independently of any grid."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tactful.dynamics import Dynamics, arm_record, kernels, motion_record
from tactful.robots import Robot

Array = NDArray[np.float64]

FORCE_N = (5.0, 40.0)
FRICTION = 0.5


@dataclass(frozen=True, eq=False)
class Contact:
    """A true contact: a force at a point of the surface, in the base."""

    link: int
    point_m: Array
    """(3,) [m]."""
    force_n: Array
    """(3,) from the environment on the robot [N]."""
    torque_nm: Array
    """What it makes at the joints (n,) [Nm]."""


class Draw:
    """Random poses and contacts of one arm.

    Poses are uniform within the joint limits (within half a turn where they are wider). Points are uniform over the
    capsules of a link, outside all other capsules. Forces are uniform in magnitude, from 5 to 40 N; their tangential
    part is uniform in a disc of 0.5 times the normal one.

    Args:
        robot: the arm.
        rng: the source of randomness.
    """

    def __init__(self, robot: Robot, rng: np.random.Generator) -> None:
        self.robot, self.rng = robot, rng
        self.links = sorted({capsule.link for capsule in robot.capsules if capsule.link >= 0})
        self._lower, self._upper = np.maximum(robot.lower, -np.pi), np.minimum(robot.upper, np.pi)
        self._dynamics = Dynamics(robot)
        arm: Any = arm_record(robot)
        motion: Any = motion_record(robot.n)
        self._arm, self._motion = arm[0], motion[0]
        self._link = np.array([capsule.link for capsule in robot.capsules])
        self._ends = np.array([(capsule.p0_m, capsule.p1_m) for capsule in robot.capsules])  # (p, 2, 3)
        self._radius = np.array([capsule.radius_m for capsule in robot.capsules])
        length = np.linalg.norm(self._ends[:, 1] - self._ends[:, 0], axis=1)  # (p,)
        self._area = 4 * np.pi * self._radius**2 + 2 * np.pi * self._radius * length

    def pose(self) -> Array:
        """Return joint positions (n,) [rad]."""
        return self.rng.uniform(self._lower, self._upper)

    def link_pose(self, q: Array, link: int) -> tuple[Array, Array]:
        """Return the rotation (3, 3) and the origin (3,) [m] of a link in the base."""
        kernels.place(self._arm, self._motion, q)
        return self._motion["R"][link].copy(), self._motion["o"][link].copy()

    def contact(self, q: Array, link: int, *, friction: float = FRICTION, displaced_m: float = 0.0) -> Contact | None:
        """Return a contact on a link, or None where the other links all but cover it.

        Args:
            q: joint positions (n,) [rad].
            link: its index.
            friction: largest ratio of the tangential to the normal force.
            displaced_m: how far from the capsule the true surface lies, in a random direction [m].
        """
        rng = self.rng
        kernels.place(self._arm, self._motion, q)
        R = np.concatenate([self._motion["R"], np.eye(3)[None]])  # (n + 1, 3, 3), the base last, as index -1
        o = np.concatenate([self._motion["o"], np.zeros((1, 3))])
        start, end = (np.einsum("pij,pj->pi", R[self._link], e) + o[self._link] for e in self._ends.transpose(1, 0, 2))
        weight = self._area * (self._link == link)
        for _ in range(500):
            k = rng.choice(len(weight), p=weight / weight.sum())
            on_axis, outward = _on_capsule(start[k], end[k], self._radius[k], rng)
            point = on_axis + self._radius[k] * outward
            if self._depth(point, start, end, k) > 0:
                continue
            tangent = np.cross(outward, rng.normal(size=3))
            tangent *= friction * np.sqrt(rng.uniform()) / np.linalg.norm(tangent)
            direction = tangent - outward
            force = rng.uniform(*FORCE_N) * direction / np.linalg.norm(direction)
            if displaced_m:
                aside = rng.normal(size=3)
                point = point + displaced_m * aside / np.linalg.norm(aside)
            return Contact(link, point, force, self._dynamics.jacobian_at(q, link, point)[:3].T @ force)
        return None

    def posed_contact(
        self, link: int | None = None, *, friction: float = FRICTION, displaced_m: float = 0.0
    ) -> tuple[Array, Contact]:
        """Return a pose and a contact on a link; by default on any, all equally likely."""
        chosen = int(self.rng.choice(self.links)) if link is None else link
        while True:
            q = self.pose()
            contact = self.contact(q, chosen, friction=friction, displaced_m=displaced_m)
            if contact is not None:
                return q, contact

    def _depth(self, point: Array, start: Array, end: Array, own: int) -> float:
        """Return how deep a point lies in any capsule but its own [m]."""
        axis = end - start  # (p, 3)
        square = np.maximum(np.einsum("pi,pi->p", axis, axis), 1e-18)
        s = np.clip(np.einsum("pi,pi->p", point - start, axis) / square, 0, 1)  # (p,)
        depth = self._radius - np.linalg.norm(point - start - s[:, None] * axis, axis=1)
        depth[own] = -np.inf
        return float(depth.max())


def _on_capsule(start: Array, end: Array, radius: float, rng: np.random.Generator) -> tuple[Array, Array]:
    """Return a point of the axis and the outward normal there, uniform over the capsule's area."""
    outward = rng.normal(size=3)
    outward /= np.linalg.norm(outward)
    axis = end - start
    length = float(np.linalg.norm(axis))
    if rng.uniform() * (length + 2 * radius) < 2 * radius:  # one of the caps
        return (end if outward @ axis > 0 else start), outward
    outward -= (outward @ axis) * axis / length**2
    return start + rng.uniform() * axis, outward / np.linalg.norm(outward)
