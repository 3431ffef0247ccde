"""The generalized likelihood ratio detector: an external torque that was not there before."""

from __future__ import annotations

import functools
import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tactful._njit import njit
from tactful.detection._config import FastConfig, NoiseConfig
from tactful.dynamics import kernels

Array = NDArray[np.float64]

_MOST_WINDOWS = 8
ABRUPT_S = 0.02
"""Length of the longest window that shows what no hand does [s]."""
_LEARN_BLOCKS, _BLOCK_S, _MEMORY_S = 4, 0.25, 10.0
"""Blocks of motion after which a scale of the thresholds is told, their length and how long they are known [s]."""
_MOVING_RAD_S = 0.05
"""Speed of a joint from which the arm moves [rad/s]."""
_TIMES, _LEAST = 2.5, 0.25
"""How many times the highest level that motion has shown is a contact, and the least scale."""
FRICTION_RAD_S = 0.03
"""Speed at which half of the friction is taken up [rad/s]."""


@functools.cache
def glr_dtype(n: int, longest: int) -> np.dtype[np.void]:
    """Return the layout of the settings and the state of a detector on n channels with windows up to `longest`."""
    return np.dtype(
        [
            ("velocity_variance", "f8", (n,)),
            ("torque_variance", "f8", (n,)),
            ("model_std", "f8", (n,)),
            ("model_speed", "f8", (n,)),
            ("model_reversal", "f8", (n,)),
            ("correlation", "f8", (n, n)),  # of the error of the model
            ("error", "f8", (n,)),  # its standard deviation now
            ("friction", "f8", (n,)),  # of each joint, -1 to 1, from its speed
            ("slow_friction", "f8", (n,)),
            ("windows", "i8"),
            ("length", "i8", (_MOST_WINDOWS,)),
            ("stride", "i8", (_MOST_WINDOWS,)),  # every how many samples the window is looked at
            ("threshold", "f8", (_MOST_WINDOWS,)),
            ("scale", "f8"),  # of the thresholds, see `_learn_scale`
            ("learns", "i8"),  # whether it is learned: nobody calibrated the arm
            ("block", "i8"),  # samples in motion of which the highest level is kept
            ("moved", "i8"),  # samples in motion so far
            ("highest", "f8", (3,)),  # level over threshold: in this block, the one before, and earlier
            ("kept", "f8"),  # share of the last that is left a block later
            ("velocity_share", "f8", (_MOST_WINDOWS,)),  # sum (dc)^2 / h^2 [1/s^2]
            ("torque_share", "f8", (_MOST_WINDOWS,)),  # sum c^2
            ("tap", "f8", (_MOST_WINDOWS, longest)),
            ("drift_gain", "f8"),  # h / drift_s
            ("contact_gain", "f8"),  # the same during a contact, so that a second one can be told
            ("started", "i8"),
            ("drifting", "i8"),  # samples in the drift since the start, as far as they are fewer than its memory
            ("position", "i8"),
            ("drift", "f8", (n,)),
            ("p", "f8", (n,)),  # of the sample before
            ("s", "f8", (n,)),
            ("x", "f8", (n,)),  # external torque over the last step
            ("ring", "f8", (n, 2 * longest)),  # every sample twice, so that a window is one piece
            ("still", "f8", (n,)),  # no speed, for channels that are not joints
            ("M", "f8", (n, n)),
            ("MDM", "f8", (n, n)),  # M diag(velocity_variance) M
            ("next", "i8"),  # the window whose covariance comes next
            ("L", "f8", (_MOST_WINDOWS, n, n)),  # of V = L L^T, with the reciprocal of its diagonal
            ("y", "f8", (_MOST_WINDOWS, n)),
            ("z", "f8", (n,)),
            ("known", "f8", (n,)),  # torque of the collision that is there
            ("known_gain", "f8"),
            ("has_known", "i8"),
            ("zk", "f8", (n,)),
            ("statistic", "f8", (_MOST_WINDOWS,)),
            ("best", "i8"),  # the window that is furthest above its threshold
            ("level", "f8", (1,)),  # its statistic over its threshold
            ("abrupt_windows", "i8"),  # how many windows, the shortest, show what is abrupt
            ("envelope", "f8", (2,)),  # what the level, and that of the abrupt windows, has been lately
            ("envelope_gain", "f8"),
            ("rise", "f8", (2,)),  # how many times that means something new
            ("risen", "i8", (2,)),  # whether it is there
        ],
        align=True,
    )


def taps(length: int) -> Array:
    """Return the weights c (length,) of a mean torque that shows one which rises, sum c = 1.

    White noise of the velocity enters through differences, so c has to begin and end smoothly; least disturbed by it
    is a parabola, c_j ~ j (L + 1 - j). A contact rises, so the newest torque tells most. c_j ~ j^2 (L + 1 - j) shows a
    ramp 1.2 times as well as the parabola, and lets 1.07 times as much noise of the torque through.
    """
    j = np.arange(1, length + 1)
    weights = j**2 * (length + 1.0 - j)
    return np.asarray(weights / weights.sum())


def glr_record(config: FastConfig, noise: NoiseConfig, scale_nm: Array, rate_hz: float) -> Any:
    """Return a detector that has seen nothing; `scale_nm` (n,) is what the noise is relative to where it is not set."""
    n = len(scale_nm)
    windows = config.windows(rate_hz)
    record: Any = np.zeros(1, glr_dtype(n, 1 << (max(windows) - 1).bit_length()))
    glr = record[0]
    glr["velocity_variance"] = noise.resolved("velocity_rad_s", scale_nm) ** 2
    glr["torque_variance"] = noise.resolved("torque_nm", scale_nm) ** 2
    glr["model_std"] = noise.resolved("model_nm", scale_nm)
    glr["model_speed"] = noise.resolved("model_nms", scale_nm)
    glr["model_reversal"] = noise.resolved("reversal_nm", scale_nm)
    glr["correlation"] = noise.correlations(n)
    glr["windows"] = len(windows)
    glr["known_gain"] = min(1.0, 1 / (config.drift_s * rate_hz))
    glr["drift_gain"] = min(1.0, 1 / (config.drift_s * rate_hz))
    glr["contact_gain"] = min(1.0, 1 / (config.contact_drift_s * rate_hz))
    glr["scale"] = 1.0
    glr["learns"] = noise.model_nm is None
    glr["block"] = max(1, round(_BLOCK_S * rate_hz))
    glr["kept"] = math.exp(-_BLOCK_S / _MEMORY_S)
    glr["abrupt_windows"] = max(1, sum(length <= ABRUPT_S * rate_hz for length in windows))
    glr["envelope_gain"] = 1 - math.exp(-1 / (config.envelope_s * rate_hz))
    glr["rise"] = config.rise, config.abrupt_rise
    for w, (length, threshold) in enumerate(windows.items()):
        c = taps(length)
        glr["length"][w] = length
        glr["stride"][w] = max(1, length // 16)
        glr["threshold"][w] = threshold
        glr["tap"][w, :length] = c
        glr["torque_share"][w] = np.sum(c**2)
        glr["velocity_share"][w] = np.sum(np.diff(c, prepend=0, append=0) ** 2) * rate_hz**2
    return record


@njit(cache=True)
def restart(glr: Any) -> None:
    """Forget all samples."""
    glr.started = 0
    glr.drifting = 0
    glr.position = 0
    glr.next = 0
    glr.ring[:, :] = 0.0
    glr.level[0] = 0.0


@njit(cache=True)
def resume(glr: Any, slow: Array, samples: int) -> None:
    """Go on after a contact that ended so many samples ago: the torque that is left is drift, windows begin anew."""
    kernels.copy(slow, glr.drift)
    glr.started = samples
    glr.statistic[:] = 0.0


@njit(cache=True)
def follow(glr: Any, slow: Array, before: Array) -> None:
    """Take what the torque changed since before a collision for the direction of that collision."""
    for i in range(glr.known.shape[0]):
        change = slow[i] - before[i]
        glr.known[i] += glr.known_gain * (change - glr.known[i]) if glr.has_known else change
    glr.has_known = 1


@njit(cache=True)
def take_momentum(glr: Any, arm: Any, motion: Any, observer: Any, dt: float) -> None:
    """Set x, the external torque over the last step, from the change of momentum, after `observe`."""
    n = glr.x.shape[0]
    for i in range(n):
        if glr.started == 0:
            glr.x[i] = glr.drift[i] = observer.r[i]
        else:
            glr.x[i] = (observer.p[i] - glr.p[i]) / dt - 0.5 * (observer.s[i] + glr.s[i])
        glr.p[i] = observer.p[i]
        glr.s[i] = observer.s[i]
    if glr.next == 0:
        kernels.mass_matrix(arm, motion, glr.M)
        M, variance = glr.M, glr.velocity_variance
        for i in range(n):
            for j in range(i + 1):
                total = 0.0
                for k in range(n):
                    total += M[i, k] * variance[k] * M[j, k]
                glr.MDM[i, j] = total


@njit(cache=True)
def _factorize(glr: Any, w: int, dq: Array) -> None:
    """Set L of window w, with the reciprocal of its diagonal."""
    L, error = glr.L[w], glr.error
    a, b = glr.velocity_share[w], glr.torque_share[w]
    for i in range(L.shape[0]):
        speed = glr.model_speed[i] * dq[i]
        reversal = glr.model_reversal[i] * (glr.friction[i] - glr.slow_friction[i])
        error[i] = np.sqrt(glr.model_std[i] ** 2 + speed * speed + reversal * reversal)
        for j in range(i + 1):
            entry = a * glr.MDM[i, j] + error[i] * error[j] * glr.correlation[i, j]
            if i == j:
                entry += b * glr.torque_variance[i]
            for k in range(j):
                entry -= L[i, k] * L[j, k]
            L[i, j] = 1.0 / np.sqrt(max(entry, 1e-300)) if i == j else entry * L[j, j]


@njit(cache=True)
def step(glr: Any, dq: Array, in_contact: bool) -> None:
    r"""Take the external torque `glr.x` of one sample and set the statistics and the level.

    For each window of L samples that ends now, with the weights c of `taps`, the mean external torque beyond its slow
    drift and its covariance under the hypothesis of no contact are

        y = sum_j c_j tau_ext,j - drift,
        V = a M diag(sigma_dq^2) M + b diag(sigma_tau^2) + diag(e) R diag(e),
        e^2 = sigma_m^2 + (sigma_mv dq)^2 + (sigma_r (z - zs))^2,

    with a = sum (dc)^2 / h^2 and b = sum c^2: noise of the measured velocity through the momentum M dq, noise of the
    measured torque, and the error e of the model with the correlation R. It is larger in motion, and after a reversal:
    z = dq / (|dq| + 0.03) is how much of the friction is taken up, zs its mean over the time of the drift. The
    statistic T = sqrt(y^T V^-1 y) is the root of twice the logarithm of the generalized likelihood ratio of any
    constant torque against none; without contact it is chi-distributed with n degrees of freedom. The level is the
    largest T over its threshold, and over the scale of the thresholds where that is learned.

    During a collision its torque k is known but for its size, since the arm may press harder. T then counts what is
    across it only, T^2 = y^T V^-1 y - (k^T V^-1 y)^2 / (k^T V^-1 k), as the paper looks away from the directions of a
    collision.

    The covariance depends on the pose through M, as the noise does: a whitening that is one for all poses alarms
    falsely where the arm has another inertia. It changes slowly, so each sample brings that of one window up to date;
    long windows are looked at every L / 16 samples.
    """
    n = glr.x.shape[0]
    longest = glr.ring.shape[1] // 2
    position = glr.position
    gain = glr.contact_gain if in_contact else glr.drift_gain
    if 0.0 < (glr.drifting + 1) * gain < 1.0:  # a mean at first: in motion the first value of all is far from the truth
        glr.drifting += 1
        gain = 1.0 / glr.drifting
    for i in range(n):
        x = glr.x[i]
        glr.drift[i] += gain * (x - glr.drift[i])
        glr.friction[i] = dq[i] / (abs(dq[i]) + FRICTION_RAD_S)
        glr.slow_friction[i] += gain * (glr.friction[i] - glr.slow_friction[i])
        glr.ring[i, position] = x
        glr.ring[i, position + longest] = x
    if glr.started == 0:
        for w in range(glr.windows):
            _factorize(glr, w, dq)
    else:
        _factorize(glr, glr.next, dq)
    glr.next = (glr.next + 1) % glr.windows
    glr.position = (position + 1) % longest
    glr.started = min(glr.started + 1, longest)
    level = abrupt = 0.0
    for w in range(glr.windows):
        if (position + w) % glr.stride[w] == 0:
            glr.statistic[w] = _statistic(glr, w, position + longest + 1)
        ratio = glr.statistic[w] / (glr.threshold[w] * glr.scale)
        if ratio > level:
            level = ratio
            glr.best = w
        if w < glr.abrupt_windows:
            abrupt = max(abrupt, ratio)
    glr.level[0] = level
    _rise(glr, 0, level)
    _rise(glr, 1, abrupt)
    if glr.learns and not in_contact:
        _learn_scale(glr, dq, level)


@njit(cache=True)
def _learn_scale(glr: Any, dq: Array, level: float) -> None:
    """Let the thresholds of an arm that nobody calibrated come down to 2.5 times what its motion has shown.

    They are for the noise of a real arm, and another may have less. The last quarter to half second is left out, so
    that a push which rises slowly is not taken for motion.
    """
    moves = False
    for i in range(dq.shape[0]):
        moves = moves or abs(dq[i]) > _MOVING_RAD_S
    if not moves:
        return
    highest = glr.highest
    highest[0] = max(highest[0], level * glr.scale)
    glr.moved += 1
    if glr.moved % glr.block == 0:
        highest[2] = max(highest[1], glr.kept * highest[2])
        highest[1] = highest[0]
        highest[0] = 0.0
        if glr.moved >= _LEARN_BLOCKS * glr.block:
            glr.scale = min(max(_TIMES * highest[2], _LEAST), 1.0)


@njit(cache=True)
def _rise(glr: Any, which: int, level: float) -> None:
    glr.risen[which] = level > max(1.0, glr.rise[which] * glr.envelope[which])
    glr.envelope[which] += glr.envelope_gain * (level - glr.envelope[which])


@njit(cache=True)
def _statistic(glr: Any, w: int, end: int) -> float:
    """Return T of window w, which ends before the column `end` of the ring, and leave y of it."""
    length = glr.length[w]
    if glr.started < length:
        return 0.0
    tap, y, z, L = glr.tap[w], glr.y[w], glr.z, glr.L[w]
    begin = end - length
    total = along = square = 0.0
    zk = glr.zk
    for i in range(y.shape[0]):
        y[i] = _weighted(tap, glr.ring[i], begin, length) - glr.drift[i]
        value = y[i]
        for j in range(i):
            value -= L[i, j] * z[j]
        z[i] = value * L[i, i]
        total += z[i] * z[i]
        if glr.has_known:
            value = glr.known[i]
            for j in range(i):
                value -= L[i, j] * zk[j]
            zk[i] = value * L[i, i]
            along += z[i] * zk[i]
            square += zk[i] * zk[i]
    if square > 0.0:
        total = max(0.0, total - along * along / square)
    return np.sqrt(total)  # type: ignore[no-any-return]


@njit(cache=True)
def _weighted(tap: Array, row: Array, begin: int, length: int) -> float:
    """Return the weighted sum of a window, in four parts that do not wait for one another."""
    s0 = s1 = s2 = s3 = 0.0
    j = 0
    while j + 3 < length:
        s0 += tap[j] * row[begin + j]
        s1 += tap[j + 1] * row[begin + j + 1]
        s2 += tap[j + 2] * row[begin + j + 2]
        s3 += tap[j + 3] * row[begin + j + 3]
        j += 4
    while j < length:
        s0 += tap[j] * row[begin + j]
        j += 1
    return (s0 + s1) + (s2 + s3)
