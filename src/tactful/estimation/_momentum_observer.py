"""The generalized momentum observer."""

from __future__ import annotations

import functools
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tactful._njit import njit
from tactful.config import ConfigError, per_joint
from tactful.dynamics import Record, arm_record, kernels, motion_record
from tactful.errors import TactfulError
from tactful.estimation._config import ObserverConfig
from tactful.estimation._velocity import sense, settled, velocity_dtype
from tactful.robots import Robot

Vector = NDArray[np.float64]


@functools.cache
def observer_dtype(n: int) -> np.dtype[np.void]:
    """Return the layout of the parameters and the state of an observer for n joints."""
    return np.dtype(
        [
            ("gain", "f8", (n,)),  # K_O [1/s]
            ("euler", "i8"),
            ("flexibility", "f8", (n,)),  # D / K [s]; 0 for a rigid joint
            ("bias", "f8", (n,)),
            ("coulomb", "f8", (n,)),
            ("viscous", "f8", (n,)),
            ("coulomb_speed", "f8"),
            ("hysteresis", "f8", (n,)),  # displacement that takes up the Coulomb friction [rad]; 0: tanh of the speed
            ("z", "f8", (n,)),  # how much of the Coulomb friction is taken up, -1 to 1
            ("velocity", velocity_dtype(n)),
            ("started", "i8"),  # 0: nothing seen; 1: the window of the velocity fills; 2: r is valid
            ("r", "f8", (n,)),
            ("p", "f8", (n,)),  # of the sample before
            ("s", "f8", (n,)),  # tau + C^T dq - g of the sample before
            ("tau", "f8", (n,)),  # of the sample before, without bias and friction
        ],
        align=True,
    )


def observer_record(robot: Robot, config: ObserverConfig) -> Record:
    """Return an observer that has seen nothing.

    Raises:
        ConfigError: if a setting does not fit the robot.
    """
    n = len(robot.joint_names)
    record: Any = np.zeros(1, observer_dtype(n))
    observer = record[0]
    observer["gain"] = 2 * np.pi * per_joint("observer", "bandwidth_hz", config.bandwidth_hz, n)
    observer["euler"] = config.integration == "euler"
    observer["bias"] = per_joint("observer", "bias_nm", config.bias_nm, n)
    observer["coulomb"] = per_joint("observer", "coulomb_nm", config.coulomb_nm, n)
    observer["viscous"] = per_joint("observer", "viscous_nms", config.viscous_nms, n)
    observer["coulomb_speed"] = config.coulomb_speed_rad_s
    observer["hysteresis"] = per_joint("observer", "hysteresis_rad", config.hysteresis_rad, n)
    observer["velocity"]["window"] = config.velocity_window_s if config.velocity == "position" else 0.0
    observer["velocity"]["clock"] = config.clock_s or 0.0
    if config.joint_flexibility:
        for figure, known in (("stiffness", robot.stiffness > 0), ("damping", np.isfinite(robot.damping))):
            if not known.all():
                problem = (
                    f"{robot.name} has no figures for the {figure} of its joints; give it some, or set this to false"
                )
                raise ConfigError("observer", "joint_flexibility", problem)
        observer["flexibility"] = robot.damping / robot.stiffness
    return record  # type: ignore[no-any-return]


@njit(cache=True)
def taken_up(observer: Any, i: int, dt: float, dq: float) -> float:
    """Return how much of the Coulomb friction of joint i is taken up, -1 to 1."""
    if observer.hysteresis[i] == 0.0:
        return np.tanh(dq / observer.coulomb_speed)  # type: ignore[no-any-return]
    if observer.started > 0:
        x = dt * dq / observer.hysteresis[i]
        observer.z[i] = (observer.z[i] + x) / (1.0 + abs(x))
    else:
        observer.z[i] = 0.0
    return observer.z[i]  # type: ignore[no-any-return]


@njit(cache=True)
def observe(observer: Any, motion: Any, dt: float, dq: Vector, tau: Vector) -> None:
    """Take one sample, after `momentum_terms`; `dt` [s] is the time since the one before."""
    for i in range(dq.shape[0]):
        friction = observer.coulomb[i] * taken_up(observer, i, dt, dq[i]) + observer.viscous[i] * dq[i]
        torque = tau[i] - observer.bias[i] - friction
        p = motion.p[i]
        s = torque + motion.ctdq[i] - motion.g[i]
        if observer.started < 2:
            observer.r[i] = -s
        else:
            K = observer.gain[i]
            r = observer.r[i]
            change = p - observer.p[i] - observer.flexibility[i] * (torque - observer.tau[i])
            if observer.euler:
                observer.r[i] = r + K * (change - dt * (s + r))
            else:
                half = 0.5 * dt
                observer.r[i] = ((1.0 - half * K) * r + K * (change - half * (s + observer.s[i]))) / (1.0 + half * K)
        observer.p[i] = p
        observer.s[i] = s
        observer.tau[i] = torque
    observer.started = 2 if settled(observer.velocity) else 1


@njit(cache=True)
def observe_motion(arm: Any, motion: Any, observer: Any, dt: float, q: Vector, dq: Vector, tau: Vector) -> float:
    """Take one sample: velocity, pose, momentum, residual; return the time that it stands for, 0 for none [s]."""
    start = observer.started == 0
    velocity = observer.velocity
    step = sense(velocity, start, dt, q, dq, tau)
    if start or step > 0.0:
        kernels.place(arm, motion, velocity.q_v)
        kernels.momentum_terms(arm, motion, velocity.v)
        observe(observer, motion, step, velocity.v, velocity.tau_v)
    return step  # type: ignore[no-any-return]


@njit(cache=True)
def _run(arm: Any, motion: Any, observer: Any, dt: Vector, q: Vector, dq: Vector, tau: Vector, r: Vector) -> None:
    for k in range(dt.shape[0]):
        observe_motion(arm, motion, observer, dt[k], q[k], dq[k], tau[k])
        r[k] = observer.r


class MomentumObserver:
    r"""Estimate the external joint torque from the momentum, without differentiating twice and without inverting M.

    With the generalized momentum p = M(q) dq,

        r = K_O ( p - \int (tau_J + D K^-1 dtau_J/dt + C^T dq - g + r) dt - p(0) ),    dr/dt = K_O (tau_ext - r),

    so each r_i is tau_ext,i behind a first-order low-pass with the cut-off K_O,i / (2 pi). tau_ext acts from the
    environment on the robot.

    The discrete form is incremental, which is the same but for rounding and cannot drift: with s = tau_J + C^T dq - g,

        trapezoid:  (1 + h K_O / 2) r_k = (1 - h K_O / 2) r_(k-1) + K_O (dp_k - h (s_k + s_(k-1)) / 2 - D K^-1 dtau_J,k)
        euler:      r_k = r_(k-1) + K_O (dp_k - h (s_k + r_(k-1)) - D K^-1 dtau_J,k)

    The elastic term needs the difference of tau_J only, no derivative. After a reset r starts at -s, not at zero: that
    is the external torque of an arm at rest, so a bias or a contact that is already there makes no transient. A sample
    that is not finite makes r NaN until the next reset.

    Source: A. De Luca, A. Albu-Schaeffer, S. Haddadin, G. Hirzinger, "Collision detection and safe reaction with the
    DLR-III lightweight manipulator arm", IROS 2006, doi:10.1109/IROS.2006.282053; the elastic term from eq. (6) of
    Proper et al. 2023. Different from them: the start.

    Args:
        robot: the arm.
        config: the settings.

    Raises:
        ConfigError: if a setting does not fit the robot.
    """

    def __init__(self, robot: Robot, config: ObserverConfig | None = None) -> None:
        arm: Any = arm_record(robot)
        motion: Any = motion_record(len(robot.joint_names))
        self._arm, self._motion = arm, motion
        self._observer: Any = observer_record(robot, config or ObserverConfig())
        self._t = -np.inf

    @property
    def r(self) -> Vector:
        """The residual r, an estimate of tau_ext (n,) [Nm]."""
        return self._observer["r"][0].copy()  # type: ignore[no-any-return]

    def update(self, t: float, q: ArrayLike, dq: ArrayLike, tau: ArrayLike) -> Vector:
        """Take one sample at the time t [s] and return r (n,) [Nm]; see `run`."""
        rows = (np.asarray(x, dtype=np.float64)[None] for x in (t, q, dq, tau))
        return self.run(*rows)[0]  # type: ignore[no-any-return]

    def run(self, t: ArrayLike, q: ArrayLike, dq: ArrayLike, tau: ArrayLike) -> Vector:
        """Take samples at the times t (k,) [s], with q, dq and tau (k, n), and return r (k, n) [Nm].

        Raises:
            TactfulError: if the shapes do not fit or the time does not increase from sample to sample.
        """
        time = np.asarray(t, dtype=np.float64)
        shape = (len(time), self._observer["r"].shape[1])
        samples = {name: np.require(x, np.float64, ["C", "W"]) for name, x in (("q", q), ("dq", dq), ("tau", tau))}
        for name, x in samples.items():
            if x.shape != shape:
                raise TactfulError(
                    f"{name} has shape {x.shape}, but {shape[0]} samples of {shape[1]} joints are {shape}"
                )
        dt = np.diff(time, prepend=self._t)  # (k,)
        if not np.all(dt > 0):
            k = int(np.argmin(dt > 0))
            raise TactfulError(f"t does not increase at sample {k}, {time[k]} s: leave it out, or reset the observer")
        r = np.empty(shape)
        _run(self._arm[0], self._motion[0], self._observer[0], dt, *samples.values(), r)
        self._t = float(time[-1]) if len(time) else self._t
        return r

    def reset(self) -> None:
        """Start anew with the next sample, whatever its time."""
        self._observer["started"] = 0
        self._t = -np.inf
