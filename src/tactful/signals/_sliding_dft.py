"""The sliding discrete Fourier transform of several axes over a band."""

from __future__ import annotations

import functools
import math
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tactful._njit import njit
from tactful.errors import TactfulError

Norm = Literal["inf"] | float


class BandError(TactfulError):
    """A band that the sampling rate and the window cannot carry; `largest_hz` is the largest one that they can."""

    def __init__(self, band_hz: tuple[float, float], rate_hz: float, window: int) -> None:
        self.band_hz, self.rate_hz, self.window = band_hz, rate_hz, window
        self.largest_hz = largest_band_hz(rate_hz, window)
        low, high = self.largest_hz
        super().__init__(
            f"band {band_hz[0]:g}-{band_hz[1]:g} Hz: a window of {window} samples at {rate_hz:g} Hz carries at most "
            f"{low:g}-{high:g} Hz in steps of {low:g} Hz; choose a band inside it that holds a step, or a longer window"
        )


def largest_band_hz(rate_hz: float, window: int) -> tuple[float, float]:
    """Return the band [1 / (N h), 1 / (2 h)] that a window of N samples with period h carries [Hz]."""
    return rate_hz / window, rate_hz / 2


def bins_in_band(band_hz: tuple[float, float], rate_hz: float, window: int) -> NDArray[np.int64]:
    """Return the indices k of the bins k rate / N that lie in the band, ends included.

    Raises:
        BandError: if the band is not inside [1 / (N h), 1 / (2 h)] or holds no bin.
        TactfulError: if there is no such window or rate.
    """
    if not (window >= 2 and 0 < rate_hz < math.inf):
        raise TactfulError(
            f"a window of {window} samples at {rate_hz:g} Hz: take at least 2 samples at a positive rate"
        )
    low, high = band_hz
    lowest, highest = largest_band_hz(rate_hz, window)
    slack = 1e-9 * rate_hz
    if not (lowest - slack <= low <= high <= highest + slack):
        raise BandError(band_hz, rate_hz, window)
    first = math.ceil((low - slack) * window / rate_hz)
    last = math.floor((high + slack) * window / rate_hz)
    if last < first:
        raise BandError(band_hz, rate_hz, window)
    return np.arange(first, last + 1)


@functools.cache
def dft_dtype(axes: int) -> np.dtype[np.void]:
    """Return the layout of the state of a sliding DFT but for its window and sums."""
    return np.dtype(
        [("k", "i8"), ("filled", "i8"), ("p", "f8"), ("x", "f8", (axes,)), ("level", "f8", (axes,))], align=True
    )


class DFTArrays:
    """Tables and state of a sliding DFT, as the kernel reads them.

    Attributes:
        twiddle: (N, 2, K) cos and -sin of 2 pi k n / N.
        window: (N, axes) the last N samples.
        sums: (axes, 4, K) real and imaginary part of the running sum and of the fresh one that replaces it.
        state: one record of `dft_dtype`.
    """

    def __init__(self, axes: int, bins: NDArray[np.int64], window: int, norm: Norm) -> None:
        angle = 2 * np.pi * (np.outer(np.arange(window), bins) % window) / window
        self.twiddle = np.ascontiguousarray(np.stack([np.cos(angle), -np.sin(angle)], axis=1))
        self.window = np.zeros((window, axes))
        self.sums = np.zeros((axes, 4, len(bins)))
        self.state: Any = np.zeros(1, dft_dtype(axes))
        self.state["p"] = math.inf if norm == "inf" else norm


@njit(cache=True)
def restart(state: Any, window: NDArray[np.float64], sums: NDArray[np.float64]) -> None:
    """Forget all samples."""
    state.k = 0
    state.filled = 0
    window[:, :] = 0.0
    sums[:, :, :] = 0.0
    state.level[:] = 0.0


@njit(cache=True)
def step(state: Any, twiddle: NDArray[np.float64], window: NDArray[np.float64], sums: NDArray[np.float64]) -> None:
    r"""Take the sample `state.x` and set `state.level`, the norm over the band of each axis.

    The modulated form, with its pole exactly at one: with W = exp(-2 pi j k / N),

        S_k(n) = S_k(n - 1) + (x(n) - x(n - N)) W^n,    |X_k| = |S_k|,    A_k = 2 |X_k| / N.

    Rounding would accumulate for ever, so a second sum starts at zero with every window and replaces the first when it
    has seen N samples: the error stays that of summing 2 N terms.

    Source: K. Duda, "Accurate, guaranteed stable, sliding discrete Fourier transform", IEEE Signal Processing Magazine
    27(6), 2010, doi:10.1109/MSP.2010.938088. Different from it: the re-anchoring.
    """
    N = twiddle.shape[0]
    n = state.k
    w = twiddle[n]
    for axis in range(window.shape[1]):
        x, S = state.x[axis], sums[axis]
        change = x - window[n, axis]
        window[n, axis] = x
        largest = 0.0  # power
        for k in range(w.shape[1]):  # one pass, which runs on vector registers
            cos, sin = w[0, k], w[1, k]
            re, im = S[0, k] + change * cos, S[1, k] + change * sin
            S[0, k], S[1, k] = re, im
            S[2, k] += x * cos
            S[3, k] += x * sin
            largest = max(largest, re * re + im * im)
        largest = np.sqrt(largest) if np.isfinite(S[0, 0]) else np.nan
        state.level[axis] = 2.0 / N * largest
        if state.p < np.inf and largest > 0.0:
            total = 0.0  # of amplitudes relative to the largest: no power overflows
            for k in range(w.shape[1]):
                total += (np.sqrt(S[0, k] * S[0, k] + S[1, k] * S[1, k]) / largest) ** state.p
            state.level[axis] *= total ** (1.0 / state.p)
    state.k = n + 1
    state.filled = min(state.filled + 1, N)
    if state.k == N:
        state.k = 0
        for axis in range(window.shape[1]):
            S = sums[axis]
            for k in range(S.shape[1]):
                S[0, k], S[1, k] = S[2, k], S[3, k]
                S[2, k] = S[3, k] = 0.0


@njit(cache=True)
def _run(
    state: Any,
    twiddle: NDArray[np.float64],
    window: NDArray[np.float64],
    sums: NDArray[np.float64],
    x: NDArray[np.float64],
    level: NDArray[np.float64],
) -> None:
    for n in range(x.shape[0]):
        for axis in range(x.shape[1]):
            state.x[axis] = x[n, axis]
        step(state, twiddle, window, sums)
        for axis in range(x.shape[1]):
            level[n, axis] = state.level[axis]


class SlidingDFT:
    """The norm of the amplitude spectrum of a signal in a band, over a window that slides with every sample.

    For each axis, with a rectangular window of N samples and without removal of the mean,

        level = || 2 |X_k| / N ||_p    over the bins k with f_min <= k rate / N <= f_max,

    so that a sine of amplitude A [N] on a bin (below half the rate) has the level A [N]. Until the window is full
    (`full`), samples before the first count as zero. A sample that is not finite makes the level NaN, for at most two
    windows.

    Args:
        axes: number of axes.
        band_hz: the band [f_min, f_max], ends included [Hz].
        rate_hz: sampling rate [Hz].
        window: N [samples].
        norm: p >= 1, or "inf" for the largest amplitude.

    Raises:
        BandError: if the rate cannot carry the band.
        TactfulError: if another setting makes no sense.

    Example:
        >>> import numpy as np
        >>> from tactful.signals import SlidingDFT
        >>> t = np.arange(1000) / 1000
        >>> dft = SlidingDFT(1, band_hz=(10, 100), rate_hz=1000, window=500)
        >>> round(float(dft.run(3 * np.sin(2 * np.pi * 20 * t)[:, None])[-1, 0]), 9)
        3.0
    """

    def __init__(
        self, axes: int, *, band_hz: tuple[float, float], rate_hz: float, window: int, norm: Norm = "inf"
    ) -> None:
        bins = bins_in_band(band_hz, rate_hz, window)
        if axes < 1 or not (norm == "inf" or norm >= 1):
            raise TactfulError(
                f"{axes} axes and the norm {norm!r}: take at least one axis, and a norm of 1 or more or 'inf'"
            )
        self.frequencies_hz = bins * rate_hz / window
        self._arrays = DFTArrays(axes, bins, window, norm)

    @property
    def full(self) -> bool:
        """Whether N samples have come since the start."""
        return bool(self._arrays.state["filled"][0] == len(self._arrays.window))

    def update(self, x: ArrayLike) -> NDArray[np.float64]:
        """Take one sample (axes,) and return the levels (axes,), in the unit of x."""
        return self.run(np.asarray(x, dtype=np.float64)[None])[0]  # type: ignore[no-any-return]

    def run(self, x: ArrayLike) -> NDArray[np.float64]:
        """Take samples (n, axes) and return their levels (n, axes), in the unit of x.

        Raises:
            TactfulError: if the samples have another number of axes.
        """
        arrays = self._arrays
        samples = np.require(x, np.float64, ["C", "W"])  # as the kernel was compiled
        axes = arrays.window.shape[1]
        if samples.ndim != 2 or samples.shape[1] != axes:
            raise TactfulError(
                f"samples of shape {samples.shape[1:]}: this transform has {axes} axes, pass {axes} numbers"
            )
        level = np.empty_like(samples)
        _run(arrays.state[0], arrays.twiddle, arrays.window, arrays.sums, samples, level)
        return level

    def reset(self) -> None:
        """Forget all samples."""
        restart(self._arrays.state[0], self._arrays.window, self._arrays.sums)
