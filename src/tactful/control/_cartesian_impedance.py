"""The Cartesian impedance controller."""

from __future__ import annotations

import functools
import math
from typing import Any

import numpy as np
from numba import typeof
from numpy.typing import ArrayLike, NDArray

from tactful._njit import njit
from tactful.control._config import ImpedanceConfig
from tactful.control._rotation import quaternion_error
from tactful.dynamics import arm_record, kernels, motion_record
from tactful.dynamics._linear import solve_positive
from tactful.errors import TactfulError
from tactful.robots import Robot

Array = NDArray[np.float64]


@functools.cache
def _controller_dtype(n: int) -> np.dtype[np.void]:
    return np.dtype(
        [
            ("stiffness", "f8", (6,)),
            ("damping", "f8", (6,)),
            ("posture_stiffness", "f8"),
            ("posture_damping", "f8"),
            ("posture", "f8", (n,)),
            ("tip_rotation", "f8", (3, 3)),  # in the tip's link
            ("limit", "f8", (n,)),  # [Nm]
            ("change", "f8"),  # largest change in one call [Nm]
            ("started", "i8"),
            ("tau", "f8", (n,)),  # of the call before
            ("q", "f8", (n,)),
            ("dq", "f8", (n,)),
            ("x_d", "f8", (3,)),
            ("R_d", "f8", (3, 3)),
            ("x", "f8", (3,)),
            ("R", "f8", (3, 3)),
            ("E", "f8", (3, 3)),
            ("error", "f8", (6,)),
            ("F", "f8", (6,)),
            ("J", "f8", (6, n)),
            ("A", "f8", (6, 6)),
            ("b", "f8", (6,)),
            ("wanted", "f8", (n,)),
        ],
        align=True,
    )


@njit(cache=True)
def _add_posture(controller: Any) -> None:
    """Add to `wanted` the posture's torque without the part that a force at the tip could balance."""
    J, A, b = controller.J, controller.A, controller.b
    n = J.shape[1]
    for i in range(n):
        spring = controller.posture_stiffness * (controller.posture[i] - controller.q[i])
        controller.tau[i] = spring - controller.posture_damping * controller.dq[i]
    trace = 0.0
    for r in range(6):
        b[r] = 0.0
        for i in range(n):
            b[r] += J[r, i] * controller.tau[i]
        for c in range(r + 1):
            A[r, c] = 0.0
            for i in range(n):
                A[r, c] += J[r, i] * J[c, i]
        trace += A[r, r]
    for r in range(6):
        A[r, r] += 1e-9 * trace
    solve_positive(A, b)
    for i in range(n):
        controller.wanted[i] += controller.tau[i]
        for r in range(6):
            controller.wanted[i] -= J[r, i] * b[r]


@njit(cache=True)
def _control(controller: Any, arm: Any, motion: Any, before: Array) -> None:
    """Set tau from q, dq, x_d and R_d; `before` (n,) is scratch for the torque of the call before."""
    q, dq, J, F, R, wanted = controller.q, controller.dq, controller.J, controller.F, controller.R, controller.wanted
    n = q.shape[0]
    kernels.place(arm, motion, q)
    kernels.tip_position(arm, motion, controller.x)
    kernels.jacobian(arm, motion, arm.tip_link, controller.x, J)
    P = motion.R[arm.tip_link]
    for r in range(3):
        for c in range(3):
            R[r, c] = 0.0
            for k in range(3):
                R[r, c] += P[r, k] * controller.tip_rotation[k, c]
        controller.error[r] = controller.x_d[r] - controller.x[r]
    quaternion_error(R, controller.R_d, controller.E, controller.error[3:])
    motion.p[:] = 0.0
    kernels.inverse_dynamics(arm, motion, dq, motion.p, wanted)
    for r in range(6):
        speed = 0.0
        for i in range(n):
            speed += J[r, i] * dq[i]
        F[r] = controller.stiffness[r] * controller.error[r] - controller.damping[r] * speed
        for i in range(n):
            wanted[i] += J[r, i] * F[r]
    before[:] = controller.tau
    if n > 6:
        _add_posture(controller)
    for i in range(n):
        tau = min(max(wanted[i], -controller.limit[i]), controller.limit[i])
        if controller.started:
            tau = min(max(tau, before[i] - controller.change), before[i] + controller.change)
        controller.tau[i] = tau
    controller.started = 1


class CartesianImpedance:
    r"""Make the tip of an arm behave like a spring and a damper between it and its reference.

    With the position error \Delta p = p_d - p and the orientation error \Delta\varepsilon (see `orientation_error`),
    both in base axes,

        F = K [\Delta p, \Delta\varepsilon] - B J dq,    tau = J^T F + C(q, dq) dq (+ g(q)).

    The reference is a pose alone, so a moving tip lags behind it by B / K times its velocity.

    An arm with more than six joints can move while its tip rests, which F cannot hinder. There the torque
    tau_0 = K_p (q_p - q) - D_p dq holds the posture q_p, projected so that no force at the tip balances it:

        tau += (1 - J^T (J J^T)^-1 J) tau_0.

    The torque is limited to the arm's (`Robot.torque_limit`) and then in its rate of change.

    Source: J. Salt Ducaju et al. 2022, doi:10.1109/RO-MAN53752.2022.9900800, (1)-(3), with its K, its B = 2 sqrt(K) in
    SI units and its virtual inertia of zero. Different from it: the damping acts against the velocity, as (1) with
    p_d - p is anti-damping as printed; the vector part of the quaternion is in base axes, where J is, and that of the
    shorter rotation; the posture, of which the paper does not speak; the limits.

    Args:
        robot: the arm; the frame `robot.tip` is controlled.
        config: the settings.
        posture: q_p (n,) [rad], `robot.home` by default.

    Raises:
        TactfulError: if the tip is fixed to the base, or the posture does not fit the arm.

    Example:
        >>> import numpy as np
        >>> from tactful import Robot
        >>> from tactful.control import CartesianImpedance
        >>> from tactful.dynamics import Dynamics
        >>> panda = Robot.load("panda")
        >>> controller = CartesianImpedance(panda)
        >>> abs(controller.torque(panda.home, np.zeros(7), *Dynamics(panda).pose(panda.home))).max() < 1e-6
        np.True_
    """

    def __init__(
        self, robot: Robot, config: ImpedanceConfig | None = None, *, posture: ArrayLike | None = None
    ) -> None:
        self.robot = robot
        self.config = config = config or ImpedanceConfig()
        tip = robot.frames[robot.tip]
        if tip.link < 0:
            raise TactfulError(
                f"{robot.name}: the tip {robot.tip!r} is fixed to the base: choose another by with_tip()"
            )
        q_p = np.asarray(robot.home if posture is None else posture, dtype=np.float64)
        if q_p.shape != (robot.n,) or not np.isfinite(q_p).all():
            raise TactfulError(f"posture is {q_p.tolist()}, but {robot.name} needs {robot.n} finite numbers")
        arm: Any = arm_record(robot)
        if not config.gravity:
            arm["gravity"] = 0.0
        motion: Any = motion_record(robot.n)
        record: Any = np.zeros(1, _controller_dtype(robot.n))
        controller = record[0]
        controller["stiffness"] = np.repeat([config.stiffness_n_m, config.stiffness_nm_rad], 3)
        controller["damping"] = np.repeat(config.damping, 3)
        controller["posture_stiffness"] = config.posture_stiffness_nm_rad
        controller["posture_damping"] = config.posture_damping_nms_rad
        controller["posture"] = q_p
        controller["tip_rotation"] = tip.rotation
        controller["limit"] = robot.torque_limit
        controller["change"] = (
            math.inf if config.torque_rate_nm_s is None else config.torque_rate_nm_s * config.period_s
        )
        self._controller = controller
        self._inputs = tuple((name, controller[name]) for name in ("q", "dq", "R_d", "x_d"))
        self._tau: Array = controller["tau"]
        self._arguments = (controller, arm[0], motion[0], np.zeros(robot.n))

    def torque(self, q: ArrayLike, dq: ArrayLike, rotation: ArrayLike, position_m: ArrayLike) -> Array:
        """Return the torque tau (n,) [Nm] for one period.

        Args:
            q: joint positions (n,) [rad].
            dq: joint velocities (n,) [rad/s].
            rotation: reference orientation R_d of the tip in the base (3, 3).
            position_m: reference position p_d of the tip in the base (3,) [m].

        Raises:
            TactfulError: if an argument has another shape, or is not finite.
        """
        for (name, view), value in zip(self._inputs, (q, dq, rotation, position_m), strict=True):
            if np.shape(value) != view.shape:
                raise TactfulError(f"{name} has shape {np.shape(value)}, but {self.robot.name} needs {view.shape}")
            view[:] = value
        _control(*self._arguments)
        tau = self._tau.copy()
        if not math.isfinite(tau.sum()):
            self.reset()
            bad = next((name for name, view in self._inputs if not np.isfinite(view).all()), "the torque")
            raise TactfulError(f"{self.robot.name}: {bad} is not finite; the torque of such a sample is not known")
        return tau

    def warm_up(self) -> None:
        """Compile the kernel or load it compiled, so that the first call does not wait for it."""
        _control.compile(tuple(typeof(argument) for argument in self._arguments))

    def reset(self) -> None:
        """Forget the torque of the call before, which limits the next one's change."""
        self._controller["started"] = 0

    @property
    def force_n(self) -> Array:
        """The spring and damper force at the tip of the last call (3,), base axes [N]."""
        return self._controller["F"][:3].copy()  # type: ignore[no-any-return]
