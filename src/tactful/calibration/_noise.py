"""The noise of the external torque in free motion, as the fast detector needs it."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import nnls
from scipy.signal import lfilter

from tactful._njit import njit
from tactful.calibration._motion import HeldOut
from tactful.detection import FastConfig, NoiseConfig
from tactful.detection._glr import taps
from tactful.dynamics import arm_record, kernels, motion_record
from tactful.estimation._momentum_observer import observe_motion, observer_record

Array = NDArray[np.float64]

_BINS = 6
"""Classes of speed."""
_SETTLING_S = 0.5
"""Time in which the drift settles [s]."""


@njit(cache=True)
def _raw(arm: Any, motion: Any, observer: Any, dt: Array, q: Array, dq: Array, tau: Array, out: Any) -> int:
    """Write the external torque over each step, the velocity, M and row of new samples; return how many there are."""
    x, v, M, row = out
    count = 0
    p, s = np.zeros(q.shape[1]), np.zeros(q.shape[1])
    started = False
    for k in range(dt.shape[0]):
        kernels.place(arm, motion, q[k])
        step = observe_motion(arm, motion, observer, dt[k], q[k], dq[k], tau[k])
        if step == 0.0 and k > 0:
            continue
        if started:
            for i in range(q.shape[1]):
                x[count, i] = (observer.p[i] - p[i]) / step - 0.5 * (observer.s[i] + s[i])
            v[count] = observer.velocity.v
            kernels.mass_matrix(arm, motion, M[count])
            row[count] = k
            count += 1
        p[:] = observer.p
        s[:] = observer.s
        started = observer.started == 2
    return count


def _external_torque(part: HeldOut) -> tuple[Array, Array, Array, NDArray[np.bool_]]:
    """Return the external torque before any filter (k, n), |v| (k, n), the mean of M_ij^2, and what counts (k,)."""
    stretch, robot, config = part.stretch, part.robot, part.observer
    n, N = robot.n, len(stretch)
    out = np.empty((N, n)), np.empty((N, n)), np.empty((N, n, n)), np.empty(N, dtype=np.int64)
    dt = np.diff(stretch.t, prepend=stretch.t[0])
    observer: Any = observer_record(robot, config)[0]
    samples = (np.require(x, np.float64, ["C", "W"]) for x in (stretch.q, stretch.dq, stretch.tau))
    count = _raw(arm_record(robot)[0], motion_record(n)[0], observer, dt, *samples, out)
    x, v, M, row = out[0][:count], out[1][:count], out[2][:count], out[3][:count]
    return x, np.abs(v), np.asarray(np.mean(M**2, axis=0)), part.counts(2 * _SETTLING_S)[row]


def noise_of(parts: Sequence[HeldOut], fast: FastConfig, rate_hz: float) -> NoiseConfig:
    r"""Return the noise that explains the windowed external torque in free motion, held-out time of a calibrated arm.

    The fast detector looks at y = \sum_j c_j tau_ext,j less a slow drift, over windows of several lengths, and takes
    its variance for

        V_ii = a \sum_j M_ij^2 sigma_dq,j^2 + b sigma_tau,i^2 + (sigma_m,i + sigma_mv,i |dq_i|)^2.

    Here the variances are found from y: all windows together by non-negative least squares with relative weights, then
    the error of the model by classes of speed, each of them by a robust standard deviation.

    Args:
        parts: motion that the arms were not calibrated to.
        fast: windows and drift of the detector.
        rate_hz: rate of the samples [Hz].
    """
    lengths = tuple(fast.windows(rate_hz))
    samples = [_external_torque(part) for part in parts]
    speed = np.concatenate([v[counts] for _, v, _, counts in samples])
    inertia = np.mean([squares for _, _, squares, _ in samples], axis=0)  # (n, n)
    y = {
        length: np.concatenate([_windowed(x, length, fast.drift_s, rate_hz)[counts] for x, _, _, counts in samples])
        for length in lengths
    }
    n = speed.shape[1]
    blocks, targets = [], []
    for length in lengths:
        c = taps(length)
        a = np.sum(np.diff(c, prepend=0, append=0) ** 2) * rate_hz**2
        variance = _robust_std(y[length]) ** 2  # (n,)
        blocks.append(np.hstack([a * inertia, np.sum(c**2) * np.eye(n), np.eye(n)]) / variance[:, None])
        targets.append(np.ones(n))
    found, _ = nnls(np.concatenate(blocks), np.concatenate(targets))
    velocity, torque, model = np.sqrt(found.reshape(3, n))
    longest = y[lengths[-1]]
    base, slope = _by_speed(longest, speed)
    floor = 0.2 * _robust_std(longest)
    still = np.sqrt(np.maximum(base**2 - _robust_std(longest) ** 2 + model**2, floor**2))
    return NoiseConfig(
        velocity_rad_s=_tuple(velocity), torque_nm=_tuple(torque), model_nm=_tuple(still), model_nms=_tuple(slope)
    )


def _windowed(x: Array, length: int, drift_s: float, rate_hz: float) -> Array:
    gain = 1 / (drift_s * rate_hz)
    start = x[: max(1, round(0.1 * rate_hz))].mean(axis=0)
    drift, _ = lfilter([gain], [1, gain - 1], x, axis=0, zi=(1 - gain) * start[None])
    mean = lfilter(taps(length)[::-1], [1.0], x - start, axis=0) + start
    return mean - drift  # type: ignore[no-any-return]


def _robust_std(y: Array) -> Array:
    """Return the larger of the standard deviation from the median and that of the inner 98 %."""
    spread = 1.4826 * np.median(np.abs(y), axis=0)
    low, high = np.quantile(y, (0.01, 0.99), axis=0)
    inner = np.sqrt(np.mean(np.clip(y, low, high) ** 2, axis=0))
    return np.maximum(np.maximum(spread, inner), 1e-6)


def _by_speed(y: Array, speed: Array) -> tuple[Array, Array]:
    """Return the standard deviation at rest (n,) and by how much it grows with the speed (n,), not below zero."""
    base, slope = np.empty(y.shape[1]), np.empty(y.shape[1])
    for i in range(y.shape[1]):
        edges = np.quantile(speed[:, i], np.linspace(0, 1, _BINS + 1))
        rows = []
        for low, high in itertools.pairwise(edges):
            inside = (speed[:, i] >= low) & (speed[:, i] <= high)
            if inside.sum() > 50:
                rows.append((1.0, float(speed[inside, i].mean()), float(_robust_std(y[inside, i : i + 1])[0])))
        table = np.array(rows)
        if len(rows) < 2:
            base[i], slope[i] = _robust_std(y[:, i : i + 1])[0], 0.0
        else:
            (base[i], slope[i]), _ = nnls(table[:, :2], table[:, 2])
    return base, slope


def _tuple(values: Array) -> tuple[float, ...]:
    return tuple(float(f"{value:.4g}") for value in values)
