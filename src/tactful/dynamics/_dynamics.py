"""The dynamics of an arm for callers in Python."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tactful.dynamics import kernels
from tactful.dynamics._arm import arm_record, motion_record
from tactful.errors import TactfulError
from tactful.robots import Frame, Robot, UnknownFrameError

Vector = NDArray[np.float64]


class Dynamics:
    """Kinematics and dynamics of an arm: M ddq + C dq + g = tau + tau_ext.

    Args:
        robot: the arm.
        motor_inertia: whether M holds the inertia of the motors; by default it does where the torque is measured on the
            motor's side (`robot.torque_sensor`).

    Example:
        >>> from tactful import Robot
        >>> from tactful.dynamics import Dynamics
        >>> panda = Robot.load("panda")
        >>> Dynamics(panda).mass_matrix(panda.home).shape
        (7, 7)
    """

    def __init__(self, robot: Robot, *, motor_inertia: bool | None = None) -> None:
        self.robot = robot
        self.n = len(robot.joint_names)
        arm: Any = arm_record(robot, motor_inertia=motor_inertia)
        motion: Any = motion_record(self.n)
        self._arm, self._motion = arm[0], motion[0]

    def _vector(self, name: str, value: ArrayLike) -> Vector:
        vector = np.require(value, np.float64, ["C", "W"])  # as the kernels were compiled
        if vector.shape != (self.n,):
            raise TactfulError(
                f"{name} has shape {vector.shape}, but {self.robot.name} has {self.n} joints: pass {self.n} numbers"
            )
        return vector

    def _frame(self, name: str | None) -> Frame:
        if name is not None and name not in self.robot.frames:
            raise UnknownFrameError(self.robot.name, name, self.robot.frames)
        return self.robot.frames[name or self.robot.tip]

    def _place(self, q: ArrayLike) -> None:
        kernels.place(self._arm, self._motion, self._vector("q", q))

    def momentum(self, q: ArrayLike, dq: ArrayLike) -> Vector:
        """Return the generalized momentum p = M(q) dq (n,)."""
        return self._momentum_terms(q, dq)["p"].copy()  # type: ignore[no-any-return]

    def coriolis_transposed(self, q: ArrayLike, dq: ArrayLike) -> Vector:
        """Return C(q, dq)^T dq (n,) [Nm], with C of the Christoffel symbols."""
        return self._momentum_terms(q, dq)["ctdq"].copy()  # type: ignore[no-any-return]

    def gravity(self, q: ArrayLike) -> Vector:
        """Return the gravity torque g(q) (n,) [Nm]."""
        return self._momentum_terms(q, np.zeros(self.n))["g"].copy()  # type: ignore[no-any-return]

    def _momentum_terms(self, q: ArrayLike, dq: ArrayLike) -> Any:
        self._place(q)
        kernels.momentum_terms(self._arm, self._motion, self._vector("dq", dq))
        return self._motion

    def mass_matrix(self, q: ArrayLike) -> Vector:
        """Return the mass matrix M(q) (n, n)."""
        M = np.empty((self.n, self.n))
        self._place(q)
        kernels.mass_matrix(self._arm, self._motion, M)
        return M

    def inverse_dynamics(self, q: ArrayLike, dq: ArrayLike, ddq: ArrayLike) -> Vector:
        """Return M(q) ddq + C(q, dq) dq + g(q) (n,) [Nm]."""
        tau = np.empty(self.n)
        self._place(q)
        kernels.inverse_dynamics(self._arm, self._motion, self._vector("dq", dq), self._vector("ddq", ddq), tau)
        return tau

    def coriolis(self, q: ArrayLike, dq: ArrayLike) -> Vector:
        """Return the Coriolis and centrifugal torque C(q, dq) dq (n,) [Nm]."""
        return self.inverse_dynamics(q, dq, np.zeros(self.n)) - self.gravity(q)

    def pose(self, q: ArrayLike, frame: str | None = None) -> tuple[Vector, Vector]:
        """Return the rotation (3, 3) and the position (3,) [m] of a frame in the base, the tip's by default."""
        target = self._frame(frame)
        self._place(q)
        if target.link < 0:
            return np.array(target.rotation), np.array(target.translation)
        R, o = self._motion["R"][target.link], self._motion["o"][target.link]
        return R @ target.rotation, o + R @ target.translation

    def jacobian(self, q: ArrayLike, frame: str | None = None) -> Vector:
        """Return the geometric Jacobian (6, n) of a frame, the tip's by default: linear above angular, base axes."""
        return self.jacobian_at(q, self._frame(frame).link, self.pose(q, frame)[1])

    def jacobian_at(self, q: ArrayLike, link: int, point_m: ArrayLike) -> Vector:
        """Return the Jacobian (6, n) of the point `point_m` (3,), given in the base, as a point of link `link`.

        Link -1 is the base.
        """
        if not -1 <= link < self.n:
            raise TactfulError(f"{self.robot.name} has no link {link}: links are -1 (base) to {self.n - 1}")
        x = np.require(point_m, np.float64, ["C", "W"])
        if x.shape != (3,):
            raise TactfulError(f"point_m has shape {x.shape}: pass 3 numbers, the point in the base")
        J = np.empty((6, self.n))
        self._place(q)
        kernels.jacobian(self._arm, self._motion, link, x, J)
        return J
