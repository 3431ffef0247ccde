"""An arm with elastic joints that touches a plane."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tactful.dynamics import Dynamics, arm_record, motion_record
from tactful.errors import TactfulError
from tactful.impacts import CompliantContactConfig, ContactPoint
from tactful.robots import Robot
from tactful.simulation.elastic._kernel import advance, elastic_dtype

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Plane:
    """A surface: a point of it [m] and its unit normal, towards the robot, both (3,) in the base frame."""

    point_m: tuple[float, float, float]
    normal: tuple[float, float, float] = (0.0, 0.0, 1.0)


class ElasticArm:
    r"""A serial arm with elastic joints, whose points may touch a plane.

    M(q) \ddot q + C \dot q + g = \tau_J + D K^-1 \dot \tau_J + \tau_ext,
    B \ddot \theta + D K^-1 \dot \tau_J + \tau_J + friction = u,    \tau_J = K (\theta - q),

    with B = `robot.motor_inertia`, K and D those of the robot, its friction at the motors, and compliant contacts with
    Coulomb friction (`contact_force`). Integrated by the classical Runge-Kutta method, u held over each call.

    Source: B. Proper et al. 2023, https://hal.science/hal-03974694v3, (1), after M. Spong 1987, doi:10.1115/1.3143860.

    Args:
        robot: the arm; it needs `stiffness`, `damping` and `motor_inertia` of its joints.
        points: points of the arm that may touch; their normals do not matter.
        plane: what they may touch; None is nothing.
        contact: how stiff the contact is, its restitution and friction.
        step_s: step of the integration; one that is too long for a stiff contact makes the state grow [s].

    Raises:
        TactfulError: if the robot lacks a figure, or there are points without a plane.

    Example:
        >>> from tactful.simulation.elastic import ElasticArm
        >>> from tactful.simulation.planar import planar_robot
        >>> arm = ElasticArm(planar_robot())
        >>> arm.reset([1.2, -1.4, -1.0])
        >>> arm.step(arm.holding, 0.1)
        >>> bool(abs(arm.dq).max() < 1e-9)
        True
    """

    def __init__(
        self,
        robot: Robot,
        points: Sequence[ContactPoint] = (),
        plane: Plane | None = None,
        contact: CompliantContactConfig | None = None,
        *,
        step_s: float = 1e-4,
    ) -> None:
        for figure, values in (
            ("stiffness", robot.stiffness),
            ("damping", robot.damping),
            ("motor_inertia", np.where(robot.motor_inertia > 0, robot.motor_inertia, np.nan)),
        ):
            if not np.isfinite(values).all():
                problem = "give it some with dataclasses.replace(robot, ...)"
                raise TactfulError(
                    f"elastic arm: {robot.name} has no figures for the {figure} of its joints; {problem}"
                )
        if points and plane is None:
            raise TactfulError("elastic arm: there are contact points, but no plane that they could touch")
        if any(not 0 <= point.link < robot.n for point in points):
            raise TactfulError(f"elastic arm: contact points have to be on links 0 to {robot.n - 1}")
        if not step_s > 0:
            raise TactfulError(f"elastic arm: step_s is {step_s}: it has to be positive")
        self.robot, self.step_s = robot, step_s
        self._dynamics = Dynamics(robot, motor_inertia=False)
        arm: Any = arm_record(robot, motor_inertia=False)
        motion: Any = motion_record(robot.n)
        record: Any = np.zeros(1, elastic_dtype(robot.n, max(len(points), 1)))
        self._arm, self._motion, self._elastic = arm[0], motion[0], record[0]
        elastic, law = self._elastic, contact or CompliantContactConfig()
        elastic["K"], elastic["D"], elastic["B"] = robot.stiffness, robot.damping, robot.motor_inertia
        elastic["viscous"], elastic["coulomb"] = robot.viscous_friction, robot.coulomb_friction
        elastic["coulomb_speed"] = 0.01
        elastic["surface"], elastic["normal"] = (0.0, 0.0, -1e9), (0.0, 0.0, 1.0)  # out of reach
        if plane is not None and points:
            elastic["surface"], elastic["normal"] = plane.point_m, plane.normal
        for c, point in enumerate(points):
            elastic["link"][c], elastic["point"][c] = point.link, point.point_m
        elastic["k"], elastic["p"], elastic["d"] = law.stiffness, law.exponent, law.damping_s_m
        elastic["mu"], elastic["v_s"] = law.friction, law.friction_speed_m_s
        self.reset(robot.home)

    def reset(self, q: ArrayLike, dq: ArrayLike | None = None) -> None:
        """Put the arm at q (n,) with dq (n,), at rest by default, the springs in balance with gravity."""
        n, place = self.robot.n, np.asarray(q, dtype=np.float64)
        speed = np.zeros(n) if dq is None else np.asarray(dq, dtype=np.float64)
        if place.shape != (n,) or speed.shape != (n,):
            raise TactfulError(f"elastic arm: q and dq have shapes {place.shape} and {speed.shape}, not ({n},)")
        theta = place + self._dynamics.gravity(place) / self.robot.stiffness
        self._elastic["state"] = np.concatenate([place, speed, theta, speed])

    def step(self, u: ArrayLike, duration_s: float) -> None:
        """Hold the torques u (n,) of the motors for a time [s].

        Raises:
            TactfulError: if the integration fails, as it does with a step that is too long for the contact.
        """
        torque = np.require(u, np.float64, ["C", "W"])
        if torque.shape != (self.robot.n,):
            raise TactfulError(f"elastic arm: u has shape {torque.shape}, not ({self.robot.n},)")
        steps = max(1, math.ceil(duration_s / self.step_s - 1e-9))
        advance(self._arm, self._motion, self._elastic, torque, duration_s / steps, steps)
        if not np.isfinite(self._elastic["state"]).all():
            raise TactfulError(f"elastic arm: the integration failed; take a step shorter than {self.step_s:g} s")

    def _part(self, k: int) -> Array:
        n = self.robot.n
        return np.array(self._elastic["state"][k * n : (k + 1) * n])

    @property
    def q(self) -> Array:
        """Positions of the links (n,) [rad]."""
        return self._part(0)

    @property
    def dq(self) -> Array:
        """Velocities of the links (n,) [rad/s]."""
        return self._part(1)

    @property
    def theta(self) -> Array:
        """Positions of the motors behind the gear (n,) [rad]."""
        return self._part(2)

    @property
    def dtheta(self) -> Array:
        """Velocities of the motors behind the gear (n,) [rad/s]."""
        return self._part(3)

    @property
    def tau(self) -> Array:
        """Torques of the springs, what a joint torque sensor measures: tau_J = K (theta - q) (n,) [Nm]."""
        return np.asarray(self.robot.stiffness * (self.theta - self.q))

    @property
    def tau_ext(self) -> Array:
        """True external torques (n,) at the end of the last step [Nm]."""
        return np.array(self._elastic["tau_ext"])

    @property
    def force(self) -> Array:
        """True forces on the contact points (c, 3) at the end of the last step, in the base frame [N]."""
        return np.array(self._elastic["force"])

    @property
    def gap(self) -> Array:
        """Distances of the contact points from the plane (c,), negative in contact [m]."""
        return np.array(self._elastic["gap"])

    @property
    def holding(self) -> Array:
        """The torques (n,) of the motors that hold the arm where it is, against gravity [Nm]."""
        return self._dynamics.gravity(self.q)

    @property
    def kinetic_and_elastic_j(self) -> float:
        """Energy of motion of links and motors, and that in the joints' springs [J]."""
        dq, dtheta, twist = self.dq, self.dtheta, self.theta - self.q
        moving = dq @ self._dynamics.momentum(self.q, dq) + dtheta @ (self.robot.motor_inertia * dtheta)
        return float(0.5 * (moving + twist @ (self.robot.stiffness * twist)))
