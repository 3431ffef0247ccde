"""Counts and times with what they leave open: intervals that hold for few observations, too."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, Self

import numpy as np

LEVEL = 0.95
"""Confidence level of every interval."""


@dataclass(frozen=True, slots=True)
class Share:
    """`count` of `total`.

    The interval is Wilson's (E. B. Wilson 1927, doi:10.1080/01621459.1927.10502953): the shares p with
    |count/total - p| <= z sqrt(p (1 - p) / total).
    """

    count: int
    total: int

    @property
    def value(self) -> float:
        """The share, nan of nothing."""
        return self.count / self.total if self.total else math.nan

    @property
    def interval(self) -> tuple[float, float]:
        """Its 95 % interval, (0, 1) of nothing."""
        if not self.total:
            return 0.0, 1.0
        from scipy.stats import binomtest

        interval = binomtest(self.count, self.total).proportion_ci(LEVEL, method="wilson")
        return float(interval.low), float(interval.high)

    def to_dict(self) -> dict[str, Any]:
        """Return plain numbers; a share of nothing is None."""
        low, high = self.interval
        value = self.value if self.total else None
        return {"count": self.count, "total": self.total, "value": value, "low": low, "high": high}


@dataclass(frozen=True, slots=True)
class Rate:
    """`count` events in `hours`.

    The interval is the exact one of a Poisson process (F. Garwood 1936, doi:10.1093/biomet/28.3-4.437): quantiles of
    chi^2 / 2 with 2 count degrees of freedom below and 2 (count + 1) above.
    """

    count: int
    hours: float

    @property
    def per_hour(self) -> float:
        """The rate [1/h], nan without time."""
        return self.count / self.hours if self.hours > 0 else math.nan

    @property
    def interval(self) -> tuple[float, float]:
        """Its 95 % interval [1/h]; (0, inf) without time."""
        if self.hours <= 0:
            return 0.0, math.inf
        from scipy.stats import chi2

        tail = (1 - LEVEL) / 2
        low = float(chi2.ppf(tail, 2 * self.count)) / 2 if self.count else 0.0
        high = float(chi2.ppf(1 - tail, 2 * (self.count + 1))) / 2
        return low / self.hours, high / self.hours

    def to_dict(self) -> dict[str, Any]:
        """Return plain numbers; what is not finite is None."""
        low, high = self.interval
        numbers = {"per_hour": self.per_hour, "low": low, "high": high}
        return {"count": self.count, "hours": self.hours} | {
            key: value if math.isfinite(value) else None for key, value in numbers.items()
        }


@dataclass(frozen=True, slots=True)
class Spread:
    """Where `n` values lie; nan where there are too few.

    Attributes:
        n: how many.
        mean: their mean.
        sd: standard deviation, of the sample (n - 1).
        median: the middle.
        p95: 95 % are below, interpolated between neighbours.
    """

    n: int
    mean: float
    sd: float
    median: float
    p95: float

    @classmethod
    def of(cls, values: Iterable[float | None]) -> Self:
        """The spread of the values that are there."""
        x = np.array([value for value in values if value is not None])
        if not len(x):
            return cls(0, math.nan, math.nan, math.nan, math.nan)
        sd = float(x.std(ddof=1)) if len(x) > 1 else math.nan
        return cls(len(x), float(x.mean()), sd, float(np.median(x)), float(np.quantile(x, 0.95)))

    def to_dict(self) -> dict[str, Any]:
        """Return plain numbers; nan is None."""
        numbers = {"mean": self.mean, "sd": self.sd, "median": self.median, "p95": self.p95}
        return {"n": self.n} | {key: value if math.isfinite(value) else None for key, value in numbers.items()}
