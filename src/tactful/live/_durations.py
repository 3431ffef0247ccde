"""How long the turns of a loop take, counted so that it costs nothing."""

from __future__ import annotations

import math

_BIN_S = 10e-6
_BINS = 1000


class Durations:
    """Counts of durations, in steps of 10 us up to 10 ms."""

    def __init__(self) -> None:
        self._counts = [0] * (_BINS + 1)

    def add(self, duration_s: float) -> None:
        """Count a duration [s]."""
        self._counts[min(int(duration_s / _BIN_S), _BINS)] += 1

    def quantile(self, share: float) -> float:
        """Return what a share of the durations does not exceed [s]; inf beyond 10 ms, nan without any."""
        counts = list(self._counts)
        left = share * sum(counts)
        for number, count in enumerate(counts):
            left -= count
            if left <= 0 and count:
                return (number + 1) * _BIN_S if number < _BINS else math.inf
        return math.nan
