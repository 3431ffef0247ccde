"""The noise of the external torque in free motion, as the fast detector needs it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import nnls
from scipy.signal import lfilter

from tactful._njit import njit
from tactful.calibration._motion import HeldOut
from tactful.config import per_joint
from tactful.detection import FastConfig, NoiseConfig
from tactful.detection._glr import FRICTION_RAD_S, glr_record, take_momentum, taps
from tactful.dynamics import arm_record, motion_record
from tactful.dynamics.kernels import copy
from tactful.estimation._momentum_observer import observe_motion, observer_record

Array = NDArray[np.float64]

_SETTLING_S = 0.5
"""Time in which the drift settles [s]."""
_ROWS = 20_000
"""Rows that the error of the model is fitted to at most."""
_STEADY = 0.7
"""Share of the noise that is there at any speed, at least: few seconds see few poses, and none of the worst."""
_FRICTION = {"link": (0.3, 0.0), "motor": (0.1, 1.0)}
"""Share of the Coulomb friction that is not sure, always and after a reversal: a gear at rest may bear all of it."""
_TOLD = 0.5
"""Share of the correlation that was found that is believed."""
_OUTLIER = 4.0


@dataclass(frozen=True, eq=False)
class FreeTorque:
    """The external torque of an arm that nothing touches.

    Attributes:
        x: over each step, before any filter (k, m) [Nm]; or the wrench [N, Nm].
        dq: velocity (k, m), zero where it is not known [rad/s].
        counts: whether a sample counts, or only lets filters settle (k,).
        inertia: mean of M_ij^2 (m, m), zero where the torque does not come from the momentum [kg^2 m^4].
        friction: how sure the Coulomb friction is not that was taken out, at any time and after a reversal (2, m) [Nm].
    """

    x: Array
    dq: Array
    counts: NDArray[np.bool_]
    inertia: Array
    friction: Array

    @classmethod
    def of(cls, part: HeldOut, fast: FastConfig, rate_hz: float) -> FreeTorque:
        """Return the external torque by the momentum."""
        stretch, robot, config = part.stretch, part.robot, part.observer
        n, N = robot.n, len(stretch)
        x, v, squares, row = np.empty((N, n)), np.empty((N, n)), np.zeros((n, n)), np.empty(N, dtype=np.int64)
        dt = np.diff(stretch.t, prepend=stretch.t[0])
        arm, motion, observer = arm_record(robot)[0], motion_record(n)[0], observer_record(robot, config)
        glr = glr_record(fast, NoiseConfig(), np.ones(n), rate_hz)[0]
        samples = (np.require(array, np.float64, ["C", "W"]) for array in (stretch.q, stretch.dq, stretch.tau))
        count = _take(arm, motion, observer[0], glr, dt, *samples, x, v, squares, row)
        friction = np.outer(_FRICTION[robot.torque_sensor], per_joint("observer", "coulomb_nm", config.coulomb_nm, n))
        return cls(x[:count], v[:count], part.counts(2 * _SETTLING_S)[row[:count]], squares / max(count, 1), friction)


@njit(cache=True)
def _take(
    arm: Any,
    motion: Any,
    observer: Any,
    glr: Any,
    dt: Array,
    q: Array,
    dq: Array,
    tau: Array,
    x: Array,
    v: Array,
    squares: Array,
    row: NDArray[np.int64],
) -> int:
    """Write torque, velocity and row of each new sample, add up M_ij^2, and return how many there are."""
    count = 0
    for k in range(dt.shape[0]):
        step = observe_motion(arm, motion, observer, dt[k], q[k], dq[k], tau[k])
        if step == 0.0 and k > 0:
            continue
        take_momentum(glr, arm, motion, observer, step)
        if glr.started:
            copy(glr.x, x[count])
            copy(observer.velocity.v, v[count])
            squares += glr.M**2
            row[count] = k
            count += 1
        glr.started = observer.started == 2
    return count


def noise_of(parts: Sequence[FreeTorque], fast: FastConfig, rate_hz: float) -> NoiseConfig:
    r"""Return the noise that explains the windowed external torque in free motion, held-out time of a calibrated arm.

    The fast detector looks at y = \sum_j c_j tau_ext,j less a slow drift, over windows of several lengths, and takes
    its variance for

        V_ii = a \sum_j M_ij^2 sigma_dq,j^2 + b sigma_tau,i^2 + sigma_m,i^2 + (sigma_mv,i dq_i)^2 + (sigma_r,i z_i)^2

    and the correlation of y that is left; z is the change of the friction, see `detection._glr.step`. The first two are
    found from y of all windows together, by non-negative least squares with relative weights; the error of the model
    from y^2 of the longest one, by the same with the weights of the variance that was found. A short recording has not
    seen the worst of the model: at any speed, sigma_m is at least a share of the noise, and of the friction.

    Args:
        parts: motion that the arms were not calibrated to.
        fast: windows and drift of the detector.
        rate_hz: rate of the samples [Hz].
    """
    lengths = tuple(fast.windows(rate_hz))
    inertia = np.mean([part.inertia for part in parts], axis=0)  # (m, m)
    y = {
        length: np.concatenate([_windowed(part.x, length, fast.drift_s, rate_hz)[part.counts] for part in parts])
        for length in lengths
    }
    m = inertia.shape[0]
    blocks, targets = [], []
    for length in lengths:
        c = taps(length)
        a, b = np.sum(np.diff(c, prepend=0, append=0) ** 2) * rate_hz**2, np.sum(c**2)
        variance = _robust_std(y[length]) ** 2  # (m,)
        blocks.append(np.hstack([a * inertia, b * np.eye(m), np.eye(m)]) / variance[:, None])
        targets.append(np.ones(m))
    found, _ = nnls(np.concatenate(blocks), np.concatenate(targets))
    velocity, torque, _ = found.reshape(3, m)  # variances
    known = a * (inertia @ velocity) + b * torque  # in the longest window

    longest = y[lengths[-1]]
    size = _robust_std(longest)
    gain = 1 / (fast.drift_s * rate_hz)
    causes = [np.concatenate([np.ones_like(part.dq[part.counts]) for part in parts])]
    causes.append(np.concatenate([part.dq[part.counts] ** 2 for part in parts]))
    causes.append(np.concatenate([_change(part.dq, gain)[part.counts] ** 2 for part in parts]))
    error = _variances(np.minimum(longest**2, (_OUTLIER * size) ** 2), np.stack(causes, axis=-1), size)  # (m, 3)
    friction = np.mean([part.friction for part in parts], axis=0)  # (2, m)
    steady = np.maximum(error[:, 0] - known, (_STEADY * size) ** 2) + friction[0] ** 2
    reversal = error[:, 2] + friction[1] ** 2
    spread = np.sqrt(known + causes[0] * steady + causes[1] * error[:, 1] + causes[2] * reversal)  # (k, m)
    return NoiseConfig(
        velocity_rad_s=_roots(velocity),
        torque_nm=_roots(torque),
        model_nm=_roots(steady),
        model_nms=_roots(error[:, 1]),
        reversal_nm=_roots(reversal),
        correlation=_correlation(longest / spread),
    )


def _windowed(x: Array, length: int, drift_s: float, rate_hz: float) -> Array:
    start = x[: max(1, round(0.1 * rate_hz))].mean(axis=0)
    drift = _slow(x, 1 / (drift_s * rate_hz), start)
    mean = lfilter(taps(length)[::-1], [1.0], x - start, axis=0) + start
    return mean - drift  # type: ignore[no-any-return]


def _slow(x: Array, gain: float, start: Array) -> Array:
    gain = min(1.0, gain)
    return lfilter([gain], [1, gain - 1], x, axis=0, zi=(1 - gain) * start[None])[0]


def _change(dq: Array, gain: float) -> Array:
    """Return by how much the friction, -1 to 1, differs from its slow mean (k, m)."""
    z = dq / (np.abs(dq) + FRICTION_RAD_S)
    return z - _slow(z, gain, z[0])


def _variances(squares: Array, causes: Array, size: Array) -> Array:
    """Return what each cause (k, m, 3) contributes to the squares (k, m) of each channel, (m, 3)."""
    stride = -(-len(squares) // _ROWS)
    squares, causes = squares[::stride], causes[::stride]
    found = np.empty((squares.shape[1], causes.shape[2]))
    for i in range(squares.shape[1]):
        weight = np.ones(len(squares))
        for _ in range(6):  # the spread of a square grows with its mean
            found[i], _ = nnls(causes[:, i] * weight[:, None], squares[:, i] * weight)
            weight = 1 / np.maximum(causes[:, i] @ found[i], (0.2 * size[i]) ** 2)
    return found


def _correlation(x: Array) -> tuple[tuple[float, ...], ...]:
    """Return the correlation of the columns of x (k, m), half way to none: few seconds do not tell it well."""
    clipped = np.clip(x, -_OUTLIER, _OUTLIER)
    power = clipped.T @ clipped
    size = np.sqrt(np.diag(power))
    R = _TOLD * power / np.outer(size, size) + (1 - _TOLD) * np.eye(len(size))
    return tuple(tuple(float(f"{value:.4g}") for value in row) for row in R)


def _robust_std(y: Array) -> Array:
    """Return the larger of the standard deviation from the median and that of the inner 98 %."""
    spread = 1.4826 * np.median(np.abs(y), axis=0)
    low, high = np.quantile(y, (0.01, 0.99), axis=0)
    inner = np.sqrt(np.mean(np.clip(y, low, high) ** 2, axis=0))
    return np.maximum(np.maximum(spread, inner), 1e-6)


def _roots(variances: Array) -> tuple[float, ...]:
    return tuple(float(f"{value:.4g}") for value in np.sqrt(variances))
