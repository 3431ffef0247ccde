"""From a wanted tolerance to the settings of the classifier."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tactful.classification import AimAwareConfig
from tactful.detection import ImpactConfig
from tactful.errors import TactfulError
from tactful.studies.aim_aware._evidence import Judged

Array = NDArray[np.float64]

MARGIN = 1.05
"""What a threshold is above the largest value that the band needs."""
_FLOORS = {"e_m_rad_s": 0.01, "epsilon_rad": 0.005, "zeta_s": 0.005, "iota_s": 0.005}
"""Least thresholds: below, noise alone would exceed them."""


def shapes(impact: ImpactConfig) -> list[AimAwareConfig]:
    """Return the envelopes that are tried: how fast they close, how long they look back and when they are judged."""
    return [
        AimAwareConfig(a_per_s=a, m_max=m_max, m_c=m_c, impact=impact)
        for a in (10.0, 18.0, 30.0)
        for m_max, m_c in ((10, 10), (15, 15), (25, 15), (25, 25), (35, 25))
    ]


def tune(judged: Sequence[tuple[AimAwareConfig, Judged]], beta_deg: Array, tolerance_deg: float) -> AimAwareConfig:
    """Return settings that accept every impact within +-tolerance, and as few others as they can.

    For a given envelope the verdict is monotone in e_m, epsilon, zeta and iota: each is the largest value
    that an impact within the tolerance needs, times `MARGIN`. Of the envelopes the one is taken that then accepts the
    smallest share outside. A margin of its own for each joint was tried and fits the runs it is tuned on too closely.

    Args:
        judged: envelopes and what they saw of the same k impacts.
        beta_deg: (k,) inclinations [deg].
        tolerance_deg: of the inclination [deg].

    Raises:
        TactfulError: if an impact within the tolerance is not felt at all, whatever the thresholds.
    """
    inside = np.abs(beta_deg) <= tolerance_deg + 1e-9
    best: tuple[float, AimAwareConfig] | None = None
    for shape, seen in judged:
        needed = {
            "e_m_rad_s": seen.needed_rad_s.max(axis=1),
            "epsilon_rad": seen.position_rad,
            "zeta_s": seen.timing_s,
            "iota_s": seen.spacing_s,
        }
        thresholds: Mapping[str, Any] = {
            name: max(floor, MARGIN * float(needed[name][inside].max())) for name, floor in _FLOORS.items()
        }
        if not np.isfinite(list(thresholds.values())).all():
            continue
        config = shape.model_copy(update=thresholds)
        outside = float(seen.accepted(config)[~inside].mean()) if not inside.all() else 0.0
        if best is None or outside < best[0]:
            best = outside, config
    if best is None:
        raise TactfulError(f"tuning to +-{tolerance_deg:g} deg: an impact within is not felt; lower r_b")
    return best[1]
