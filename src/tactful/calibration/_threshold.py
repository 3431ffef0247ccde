"""The threshold of a statistic for a stated rate of false alarms, by extreme-value theory."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tactful.errors import TactfulError

Array = NDArray[np.float64]

_CLUSTERS = 50
"""Peaks that a tail is fitted to where there are so many; of a long recording, the upper twentieth."""
_FEWEST = 5
"""Peaks without which there is no fit."""
_SHAPE_SPREAD = 0.1
"""Standard deviation of the shape of the tail about the exponential one, before any data."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Threshold:
    """A threshold and how far it can be trusted."""

    value: float
    """Level that the statistic exceeds at the stated rate, the median of what the data allow."""
    low: float
    """Lower end of the 90 % interval of that level."""
    high: float
    """Upper end of the interval."""
    false_alarms_per_hour: float
    """The stated rate [1/h]."""
    duration_s: float
    """How much was recorded [s]."""
    supported: bool
    """Whether the recording is long enough to have seen such a level: three times the mean time between alarms."""
    statement: str
    """That, in words."""


def threshold_for_rate(
    statistic: ArrayLike,
    rate_hz: float,
    false_alarms_per_hour: float = 0.125,
    *,
    separation_s: float = 0.1,
    amplitude: bool = False,
) -> Threshold:
    r"""Return the threshold that a statistic exceeds at a stated rate while nothing happens.

    Peaks over a high level u, one in `separation_s` at most, come at a rate \zeta and are Pareto distributed beyond u,
    P(X > u + y) = (1 + \xi y / \sigma)^(-1/\xi). The level that is exceeded at the rate \lambda is

        x = u + \sigma / \xi ((\zeta / \lambda)^\xi - 1).

    The interval is that of the posterior of (\xi, \sigma), flat in log \sigma and normal about \xi = 0, an exponential
    tail, with a standard deviation of 0.1: a few dozen peaks alone would allow any shape.

    Source: S. Coles, "An Introduction to Statistical Modeling of Extreme Values", Springer 2001,
    doi:10.1007/978-1-4471-3675-0, chapter 4; the prior on the shape after E. S. Martins, J. R. Stedinger 2000,
    doi:10.1029/1999WR900330, but narrower.

    Args:
        statistic: its values in free motion (k,), or several stretches of them, evenly sampled.
        rate_hz: their rate [Hz].
        false_alarms_per_hour: the stated rate [1/h].
        separation_s: the largest value in each span of this length counts, so that one alarm is one peak [s].
        amplitude: whether the statistic is an amplitude or a norm, not negative, as of Gaussian noise: its square is
            extrapolated, whose tail is the exponential one.

    Raises:
        TactfulError: if there are too few values, or they are not finite.
    """
    x = np.asarray(statistic, dtype=np.float64).ravel()
    if not np.isfinite(x).all():
        raise TactfulError(f"the statistic has {np.sum(~np.isfinite(x))} values that are not finite: leave them out")
    if not false_alarms_per_hour > 0:
        raise TactfulError(f"a rate of false alarms must be positive, not {false_alarms_per_hour} per hour")
    duration_s = len(x) / rate_hz
    u, peaks = _peaks(x**2 if amplitude else x, max(1, round(separation_s * rate_hz)))
    if len(peaks) < _FEWEST:
        raise TactfulError(
            f"{duration_s:.3g} s are too short for a threshold: {len(peaks)} separate peaks, but {_FEWEST} are needed"
        )
    levels = _levels(peaks - u, len(peaks) / duration_s, false_alarms_per_hour / 3600) + u
    low, value, high = np.sqrt(levels) if amplitude else levels
    supported, statement = support(false_alarms_per_hour, duration_s, float(value) / float(x.max()))
    return Threshold(
        value=float(value),
        low=float(low),
        high=float(high),
        false_alarms_per_hour=false_alarms_per_hour,
        duration_s=duration_s,
        supported=supported,
        statement=statement,
    )


def support(false_alarms_per_hour: float, duration_s: float, ratio: float) -> tuple[bool, str]:
    """Return whether a time supports a rate, and that in words; `ratio` is that of threshold and highest level seen."""
    factor = 3600 / (false_alarms_per_hour * duration_s)
    asked, seen = f"one false alarm in {_span(3600 / false_alarms_per_hour)}", f"{_span(duration_s)} of free motion"
    if factor <= 1 / 3:
        return True, f"{asked} is supported by {seen}"
    return False, (
        f"{asked} is not supported by {seen}: the threshold is extrapolated by a factor of {factor:.3g} in time, "
        f"{ratio - 1:.0%} above the highest level seen; record {_span(3 * 3600 / false_alarms_per_hour)} to verify it"
    )


def _peaks(x: Array, block: int) -> tuple[float, Array]:
    """Return a level u and the peaks above it: of the largest values of all blocks, the upper half or fewer."""
    maxima = np.maximum.reduceat(x, np.arange(0, len(x), block)) if len(x) else x
    count = max(min(_CLUSTERS, len(maxima) // 2), len(maxima) // 20)
    ordered = np.sort(maxima)[::-1]
    return (float(ordered[count]), ordered[:count]) if len(maxima) > count else (0.0, np.zeros(0))


def _levels(excess: Array, peaks_per_s: float, alarms_per_s: float) -> Array:
    """Return the 5, 50 and 95 % points of the level that is exceeded at the rate asked for."""
    shape = np.linspace(-0.4, 0.4, 81)[:, None]
    shape = np.where(np.abs(shape) < 1e-9, 1e-9, shape)
    scale = excess.mean() * np.geomspace(0.2, 5.0, 161)[None, :]
    inside = 1 + shape[..., None] * excess / scale[..., None]  # (81, 161, k)
    possible = (inside > 0).all(axis=-1)
    with np.errstate(invalid="ignore", divide="ignore"):
        likelihood = -len(excess) * np.log(scale) - (1 + 1 / shape) * np.log(np.maximum(inside, 1e-300)).sum(axis=-1)
    posterior = np.where(possible, likelihood - 0.5 * (shape / _SHAPE_SPREAD) ** 2, -np.inf)
    probability = np.exp(posterior - posterior.max()).ravel()
    ratio = max(peaks_per_s / alarms_per_s, 1.0)
    level = (scale / shape * np.expm1(shape * np.log(ratio))).ravel()
    order = np.argsort(level)
    share = np.cumsum(probability[order]) / probability.sum()
    return level[order][np.searchsorted(share, (0.05, 0.5, 0.95))]  # type: ignore[no-any-return]


def _span(seconds: float) -> str:
    if seconds < 120:
        return f"{seconds:.3g} s"
    return f"{seconds / 60:.3g} min" if seconds < 7200 else f"{seconds / 3600:.3g} h"
