"""Which inclinations are accepted: always, sometimes, never."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Bands:
    """The share of accepted impacts over the inclination.

    Attributes:
        beta_deg: the inclinations (k,) [deg].
        rate: share that is accepted at each (k,).
        count: impacts at each (k,).
    """

    beta_deg: Array
    rate: Array
    count: NDArray[np.int64]

    @classmethod
    def of(cls, beta_deg: Array, accepted: NDArray[np.bool_]) -> Bands:
        """Count impacts by their inclination (k,) [deg] and whether they were accepted (k,)."""
        values, which, count = np.unique(np.round(beta_deg, 6), return_inverse=True, return_counts=True)
        return cls(values, np.bincount(which, weights=accepted) / count, count)

    @property
    def band_deg(self) -> tuple[float, float] | None:
        """The inclinations about zero that are always accepted; None if zero is not [deg]."""
        zero = int(np.argmin(np.abs(self.beta_deg)))
        if self.rate[zero] < 1:
            return None
        low = high = zero
        while low > 0 and self.rate[low - 1] == 1:
            low -= 1
        while high < len(self.rate) - 1 and self.rate[high + 1] == 1:
            high += 1
        return float(self.beta_deg[low]), float(self.beta_deg[high])

    def _reach(self) -> tuple[int, int, int, int]:
        """Rows of the band's ends, and of the last inclinations next to it that are accepted at times."""
        ends = self.band_deg or (0.0, 0.0)
        low, high = (int(np.argmin(np.abs(self.beta_deg - end))) for end in ends)
        outer, upper = low, high
        while outer > 0 and self.rate[outer - 1] > 0:
            outer -= 1
        while upper < len(self.rate) - 1 and self.rate[upper + 1] > 0:
            upper += 1
        return low, high, outer, upper

    @property
    def ambiguous_deg(self) -> tuple[float, float]:
        """How far on each side of the band impacts are accepted at times, up to where none is [deg]."""
        low, high, outer, upper = self._reach()
        return (
            float(self.beta_deg[low] - self.beta_deg[outer]),
            float(self.beta_deg[upper] - self.beta_deg[high]),
        )

    @property
    def accepted_beyond(self) -> float:
        """Share that is accepted beyond the ambiguous inclinations."""
        *_, outer, upper = self._reach()
        beyond = np.ones(len(self.rate), dtype=bool)
        beyond[outer : upper + 1] = False
        return float(np.average(self.rate[beyond], weights=self.count[beyond])) if beyond.any() else 0.0

    def within(self, tolerance_deg: float) -> float:
        """Share that is accepted within +-tolerance."""
        rows = np.abs(self.beta_deg) <= tolerance_deg + 1e-9
        return float(np.average(self.rate[rows], weights=self.count[rows]))

    def summary(self) -> dict[str, object]:
        """The figures as JSON-ready data."""
        band = self.band_deg
        return {
            "band_deg": None if band is None else list(band),
            "ambiguous_deg": list(self.ambiguous_deg),
            "accepted_beyond": self.accepted_beyond,
            "impacts": int(self.count.sum()),
            "beta_deg": self.beta_deg.tolist(),
            "rate": self.rate.tolist(),
        }
