"""The impact-aware controller of any serial arm."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tactful._njit import njit
from tactful.control._impact_aware import ImpactControlConfig
from tactful.control._reference_spreading import ReferenceSpreading
from tactful.control._rotation import orientation_error
from tactful.dynamics import arm_record, kernels, motion_record
from tactful.errors import TactfulError
from tactful.robots import Robot
from tactful.robots._geometry import rotation_about

Array = NDArray[np.float64]
Phase = Literal["ante", "interim", "post"]

_STEP_S = 1e-5
"""Over which the Jacobian's change is measured [s]."""
_RANK = 1e-8
"""Share of the tip's largest mobility below which a direction is one in which it cannot move."""


class ImpactAwareController:
    r"""Lead the tip of an arm through a planned impact with a surface, and leave it pressed against that.

    With the pose error (\Delta p, \Delta\phi) of the tip and its reference x_d of six coordinates,

        u = M_r (J^# (\ddot x_d - \dot J \dot q) + N z) + C \dot q (+ g) + J^T F,
        F = K_p (\Delta p, \Delta\phi) + K_d (\dot x_d - \dot x),

    where J^# = M_r^-1 J^T (J M_r^-1 J^T)^+ and N = 1 - J^# J split the motion of the joints into that of the tip and
    one that the tip does not feel, also where the arm has more joints than the tip needs, or fewer: z =
    w^2 (q_p - q) - 2 w \dot q holds the posture without a force at the tip. From the first detected impact on the
    reference is the post-impact one, and a constant force along the normal stands in place of F's; between the impacts
    of the points that land (the interim phase) the velocity is not fed back.

    The coordinates are the position in base axes, and a rotation vector in base axes from `rotation`.

    Sources: B. Proper et al. 2023, https://hal.science/hal-03974694v3, Sec. III-A (for a planar arm); O. Khatib 1987,
    doi:10.1109/JRA.1987.1087068 (J^# and N).

    Args:
        robot: the arm; the frame `robot.tip` is controlled, and `motor_inertia` counts, as the torque loop leaves it.
        reference: of six coordinates, before and after the impact.
        rotation: of the tip at the impact, in the base (3, 3).
        normal: unit normal of the surface, towards the robot, in the base (3,).
        posture: q_p (n,) [rad].
        config: the settings; their three coordinates are along the surface, along its normal, and any rotation.
        gravity: whether g is added, or the arm itself bears it.
        posture_rate: w [1/s].

    Raises:
        TactfulError: if the reference or the posture has another size.
    """

    def __init__(
        self,
        robot: Robot,
        reference: ReferenceSpreading,
        rotation: ArrayLike,
        normal: ArrayLike,
        posture: ArrayLike,
        config: ImpactControlConfig | None = None,
        *,
        gravity: bool = True,
        posture_rate: float = 5.0,
    ) -> None:
        self.config = config or ImpactControlConfig()
        self._posture = np.asarray(posture, dtype=np.float64)
        self._rotation = np.asarray(rotation, dtype=np.float64)
        self._normal = np.asarray(normal, dtype=np.float64)
        if reference.m != 6 or self._posture.shape != (robot.n,):
            sizes = f"{reference.m} coordinates, posture {self._posture.shape}"
            raise TactfulError(f"impact-aware control of {robot.name}: {sizes}; expected 6 and ({robot.n},)")
        self._tip = robot.frames[robot.tip]
        self._reference, self._rate = reference, posture_rate
        across = np.outer(self._normal, self._normal)
        along = np.eye(3) - across
        gains = (self.config.stiffness, self.config.damping)
        self._free = [gain[0] * along + gain[1] * across for gain in gains]  # stiffness and damping (3, 3)
        self._pressed = [gain[0] * along for gain in gains]
        arm: Any = arm_record(robot, motor_inertia=True)
        if not gravity:
            arm["gravity"] = 0.0
        motion: Any = motion_record(robot.n)
        n = robot.n
        self._motion = motion[0]
        self._terms = np.empty(3), np.empty((6, n)), np.empty((6, n)), np.empty((n, n)), np.empty(n)
        self._records = arm[0], motion[0], np.zeros(n)

    def torque(self, t: float, q: ArrayLike, dq: ArrayLike, phase: Phase) -> Array:
        """Return the torque u (n,) [Nm] at the time t [s].

        Args:
            t: on the clock of the reference [s].
            q: joint positions (n,) [rad].
            dq: joint velocities (n,) [rad/s].
            phase: of the motion.
        """
        place, speed = (np.require(value, np.float64, ["C", "W"]) for value in (q, dq))
        _tip_terms(*self._records, place, speed, place + _STEP_S * speed, *self._terms)
        x, J, J_next, M_r, bias = self._terms
        R = self._motion["R"][self._tip.link] @ self._tip.rotation
        x_d, dx_d, ddx_d = self._reference.at(t, post=phase != "ante")
        swing = (J_next - J) @ speed / _STEP_S  # dJ/dt dq (6,)
        inverse = consistent_inverse(M_r, J)
        z = self._rate**2 * (self._posture - place) - 2.0 * self._rate * speed
        ddq = inverse @ (ddx_d - swing) + z - inverse @ (J @ z)
        error = np.concatenate([x_d[:3] - x, 2.0 * orientation_error(R, turned(x_d[3:], self._rotation))])
        F = self._force(phase, error, dx_d, J @ speed)
        return np.asarray(M_r @ ddq + bias + J.T @ F)

    def _force(self, phase: Phase, error: Array, dx_d: Array, dx: Array) -> Array:
        """Return the force and moment (6,) on the tip."""
        config, n = self.config, self._normal
        K, D = self._free if phase == "ante" else self._pressed
        fed_back = phase != "interim"
        F = np.empty(6)
        F[:3] = K @ error[:3] + fed_back * (D @ (dx_d[:3] - dx[:3]))
        F[3:] = config.stiffness[2] * error[3:] + fed_back * config.damping[2] * (dx_d[3:] - dx[3:])
        if phase != "ante":
            slide = dx_d[:3] - (dx_d[:3] @ n) * n
            F[:3] += config.normal_force_n * n - config.friction * config.normal_force_n * np.tanh(slide / 0.01)
        return F


@njit(cache=True)
def _tip_terms(
    arm: Any,
    motion: Any,
    zero: Array,
    q: Array,
    dq: Array,
    q_next: Array,
    x: Array,
    J: Array,
    J_next: Array,
    M: Array,
    bias: Array,
) -> None:
    """Set the tip's position (3,), its Jacobians (6, n) at q and a moment later, M (n, n), and C dq + g (n,)."""
    kernels.place(arm, motion, q_next)
    kernels.tip_position(arm, motion, x)
    kernels.jacobian(arm, motion, arm.tip_link, x, J_next)
    kernels.place(arm, motion, q)
    kernels.tip_position(arm, motion, x)
    kernels.jacobian(arm, motion, arm.tip_link, x, J)
    kernels.mass_matrix(arm, motion, M)
    kernels.inverse_dynamics(arm, motion, dq, zero, bias)


def consistent_inverse(M: Array, J: Array) -> Array:
    r"""Return J^# = M^-1 J^T (J M^-1 J^T)^+ (n, 6): the joint motion of least kinetic energy for one of the tip.

    Directions in which the tip cannot move are left out.
    """
    weighted = np.linalg.solve(M, J.T)  # (n, 6)
    mobility, axes = np.linalg.eigh(J @ weighted)
    able = mobility > _RANK * mobility[-1]
    return np.asarray(weighted @ (axes[:, able] / mobility[able]) @ axes[:, able].T)


def turned(rotation_vector: Array, rotation: Array) -> Array:
    """Return a rotation (3, 3), turned further by a rotation vector (3,) in base axes [rad]."""
    angle = float(np.linalg.norm(rotation_vector))
    if angle == 0.0:
        return rotation
    return np.asarray(rotation_about(rotation_vector / angle, angle) @ rotation)
