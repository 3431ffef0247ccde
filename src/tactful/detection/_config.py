"""Settings of the detection of contact."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from tactful.config import Config
from tactful.signals import bins_in_band

PositiveFloat = Annotated[float, Field(gt=0)]
NonNegativeFloat = Annotated[float, Field(ge=0)]


class FrequencyConfig(Config):
    """The frequency content of the external force as a sign of contact: condition (4) of the paper."""

    threshold_n: PositiveFloat | tuple[PositiveFloat, PositiveFloat, PositiveFloat] = 0.85
    """F_th, the level that means contact, for all directions or for x, y and z [N]."""
    band_hz: tuple[PositiveFloat, PositiveFloat] = (10.0, 100.0)
    """Frequency range of the level, ends included [Hz]."""
    window: Annotated[int, Field(ge=2)] = 500
    """N, the length of the sliding window [samples]."""
    norm: Literal["inf"] | Annotated[float, Field(ge=1)] = "inf"
    """p of the norm over the band, or "inf" for the largest amplitude, as in the paper."""

    def check_rate(self, rate_hz: float) -> None:
        """Check that the rate carries the band.

        Raises:
            BandError: if it does not; the error names the largest band that it carries.
        """
        bins_in_band(self.band_hz, rate_hz, self.window)


class ContactConfig(Config):
    """When one contact begins, goes on and ends. The paper's own value is named where it differs from the default."""

    release_ratio: Annotated[float, Field(gt=0, le=1)] = 0.7
    """A direction is quiet when its level is below this share of the threshold. Paper: 1."""
    hold_s: NonNegativeFloat = 0.1
    """How long a direction has to be quiet before it counts as released [s]. Paper: 0."""
    release_force_n: PositiveFloat | None = 1.5
    """A contact lasts while the force differs by more than this from the force before it, in any direction [N]: the
    level has no constant part, so it falls to zero half a second into a steady push. None looks at the level alone.
    Paper: None."""
    collision_to_free: bool = True
    """Whether a collision ends when all is quiet. Paper: false, the transition is not part of Algorithm 1."""
    merge_s: NonNegativeFloat = 0.15
    """A further direction whose rise began at most so long after that of the contact that is there belongs to it: one
    impact spreads over the axes and would be classified again [s]. Paper: 0."""
    search_s: PositiveFloat = 0.5
    """How far back the search for the contact time goes [s]. The paper does not say."""
    onset_fraction: Annotated[float, Field(gt=0, lt=1)] = 0.15
    """Share of the rise at which the contact time is set, see `onset_index`. The paper does not say."""
    warm_up_s: NonNegativeFloat = 0.0
    """Time after a start in which nothing is detected, beyond the window that has to fill [s]."""
    gap_s: PositiveFloat = 0.05
    """A step in time longer than this, and than five samples, makes the monitor start anew [s]."""
