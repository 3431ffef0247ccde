"""Signal kernels: one sample in, one value out, no allocation."""

from tactful.signals._envelope import CausalEnvelope
from tactful.signals._onset import onset_index
from tactful.signals._sliding_dft import BandError, DFTArrays, SlidingDFT, bins_in_band, largest_band_hz

__all__ = [
    "BandError",
    "CausalEnvelope",
    "DFTArrays",
    "SlidingDFT",
    "bins_in_band",
    "largest_band_hz",
    "onset_index",
]
