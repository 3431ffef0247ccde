"""The causal envelope of a signal that oscillates."""

from __future__ import annotations

import functools
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tactful._njit import njit
from tactful.errors import TactfulError

Array = NDArray[np.float64]

_CAPACITY = 64
"""Least number of samples that are kept, so that most windows share one compiled kernel."""


@functools.cache
def envelope_dtype(axes: int, window: int) -> np.dtype[np.void]:
    """Return the layout of the settings and the state of an envelope with windows of up to `window` + 1 samples."""
    capacity = _CAPACITY
    while capacity <= window:
        capacity *= 2
    return np.dtype(
        [
            ("a", "f8"),  # [1/s]
            ("m_max", "i8"),
            ("m", "i8"),  # of the next sample
            ("k", "i8"),  # where the next sample goes
            ("filled", "i8"),  # samples in the ring
            ("ring", "f8", (axes, 2 * capacity)),  # each sample twice, so that every window is one piece
            ("lower", "f8", (axes,)),
            ("upper", "f8", (axes,)),
        ],
        align=True,
    )


def envelope_record(axes: int, a_per_s: float, window: int) -> Any:
    """Return an envelope that has seen nothing."""
    record: Any = np.zeros(1, envelope_dtype(axes, window))
    record["a"], record["m_max"] = a_per_s, window
    return record


@njit(cache=True)
def remember(envelope: Any, x: Array) -> None:
    """Take one sample (axes,), before `restart` or `advance`."""
    capacity = envelope.ring.shape[1] // 2
    for i in range(x.shape[0]):
        envelope.ring[i, envelope.k] = x[i]
        envelope.ring[i, envelope.k + capacity] = x[i]
    envelope.k = (envelope.k + 1) % capacity
    envelope.filled = min(envelope.filled + 1, capacity)


@njit(cache=True)
def restart(envelope: Any, x: Array, m: int) -> None:
    """Begin at the sample x with the window m: both bounds are x."""
    for i in range(x.shape[0]):
        envelope.lower[i] = x[i]
        envelope.upper[i] = x[i]
    envelope.m = min(m + 1, envelope.m_max)


@njit(cache=True)
def advance(envelope: Any, dt: float) -> None:
    """Move the bounds to the sample that was remembered last, the time dt [s] after the one before."""
    capacity = envelope.ring.shape[1] // 2
    last = (envelope.k - 1) % capacity + capacity
    first = last - min(envelope.m, envelope.filled - 1)
    share = min(envelope.a * dt, 1.0)
    for i in range(envelope.lower.shape[0]):
        x = envelope.ring[i]
        low = high = x[last]
        for k in range(first, last):
            low = min(low, x[k])
            high = max(high, x[k])
        envelope.lower[i] = min(low, (1.0 - share) * envelope.lower[i] + share * low)
        envelope.upper[i] = max(high, (1.0 - share) * envelope.upper[i] + share * high)
    envelope.m = min(envelope.m + 1, envelope.m_max)


@njit(cache=True)
def _run(envelope: Any, started: bool, dt: Array, x: Array, lower: Array, upper: Array) -> None:
    for k in range(x.shape[0]):
        remember(envelope, x[k])
        if started:
            advance(envelope, dt[k])
        else:
            restart(envelope, x[k], 0)
            started = True
        for i in range(x.shape[1]):
            lower[k, i] = envelope.lower[i]
            upper[k, i] = envelope.upper[i]


class CausalEnvelope:
    r"""The band in which a signal oscillates, from its past alone.

    With the extrema x_min and x_max of the last m + 1 samples and h the time since the sample before,

        x_lb,k = min(x_min,k, (1 - a h) x_lb,k-1 + a h x_min,k)
        x_ub,k = max(x_max,k, (1 - a h) x_ub,k-1 + a h x_max,k):

    each bound follows a new extremum at once and comes back to the signal with the rate a. m is 0 at the first sample
    after a reset and grows by one with every sample, up to `window`.

    Source: B. Proper et al. 2023, https://hal.science/hal-03974694v3, (15) and (16). Different from it: a h is at most
    1, for gaps in time.

    Args:
        axes: number of axes.
        a_per_s: decay rate a [1/s].
        window: m_max [samples].

    Raises:
        TactfulError: if a setting makes no sense.

    Example:
        >>> from tactful.signals import CausalEnvelope
        >>> envelope = CausalEnvelope(1, a_per_s=100.0, window=1)
        >>> lower, upper = envelope.run([0.0, 0.1, 0.2, 0.3], [[0.0], [2.0], [1.0], [1.0]])
        >>> upper[:, 0].tolist(), lower[:, 0].tolist()
        ([0.0, 2.0, 2.0, 1.0], [0.0, 0.0, 1.0, 1.0])
    """

    def __init__(self, axes: int, *, a_per_s: float, window: int) -> None:
        if not (axes >= 1 and a_per_s > 0 and window >= 0):
            raise TactfulError(
                f"an envelope of {axes} axes with the decay {a_per_s:g} 1/s over {window} samples: take at least one "
                "axis, a positive decay and a window that is not negative"
            )
        self._envelope: Any = envelope_record(axes, a_per_s, window)
        self._t: float | None = None

    def update(self, t: float, x: ArrayLike) -> tuple[Array, Array]:
        """Take the sample x (axes,) at the time t [s] and return the lower and the upper bound (axes,)."""
        lower, upper = self.run([t], np.asarray(x, dtype=np.float64)[None])
        return lower[0], upper[0]

    def run(self, t: ArrayLike, x: ArrayLike) -> tuple[Array, Array]:
        """Take samples x (k, axes) at the times t (k,) [s] and return the lower and the upper bounds (k, axes).

        Raises:
            TactfulError: if the shapes do not fit, a number is not finite, or the time does not increase.
        """
        time, samples = np.asarray(t, dtype=np.float64), np.require(x, np.float64, ["C", "W"])
        shape = (time.size, self._envelope["lower"].shape[1])
        if time.ndim != 1 or samples.shape != shape:
            raise TactfulError(f"x has shape {samples.shape}, but {shape[0]} samples of {shape[1]} axes are {shape}")
        started = self._t is not None
        dt = np.diff(time, prepend=-np.inf if self._t is None else self._t)  # (k,)
        if not (np.all(dt > 0) and np.isfinite(samples).all() and np.isfinite(time).all()):
            raise TactfulError(
                "x and t must be finite, and t has to increase from sample to sample: leave bad ones out"
            )
        lower, upper = np.empty(shape), np.empty(shape)
        _run(self._envelope[0], started, dt, samples, lower, upper)
        self._t = float(time[-1]) if len(time) else self._t
        return lower, upper

    def reset(self) -> None:
        """Begin anew with the next sample, whatever its time."""
        self._envelope["filled"] = 0
        self._t = None
