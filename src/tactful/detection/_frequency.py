"""The frequency detector: condition (4) of the kinesthetic paper."""

from __future__ import annotations

from typing import Any

import numpy as np

from tactful.detection._config import FrequencyConfig
from tactful.signals import DFTArrays, bins_in_band

AXES = ("x", "y", "z")


def frequency_arrays(config: FrequencyConfig, rate_hz: float) -> DFTArrays:
    """Return the tables and the state of the detector.

    The condition is F_w^i > F_th for a direction i in {x, y, z}, where F_w^i is the norm over the band of the amplitude
    spectrum of the external force along i, see `SlidingDFT`.

    Source: J. Salt Ducaju et al. 2022, doi:10.1109/RO-MAN53752.2022.9900800, (4). The paper leaves the scale of the
    transform open: here 2 |X_k| / N, the amplitude in newtons.

    Raises:
        BandError: if the rate cannot carry the band.
    """
    bins = bins_in_band(config.band_hz, rate_hz, config.window)
    return DFTArrays(len(AXES), bins, config.window, config.norm)


def thresholds(config: FrequencyConfig) -> np.ndarray[Any, np.dtype[np.float64]]:
    """Return F_th for x, y and z (3,) [N]."""
    return np.array(np.broadcast_to(config.threshold_n, (len(AXES),)), dtype=np.float64)
