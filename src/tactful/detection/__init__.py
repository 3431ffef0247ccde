"""Is there contact."""

from tactful.detection._config import ContactConfig, FastConfig, FrequencyConfig, NoiseConfig
from tactful.detection._frequency import AXES, frequency_arrays, thresholds
from tactful.detection._impact import ImpactConfig, ImpactDetector

__all__ = [
    "AXES",
    "ContactConfig",
    "FastConfig",
    "FrequencyConfig",
    "ImpactConfig",
    "ImpactDetector",
    "NoiseConfig",
    "frequency_arrays",
    "thresholds",
]
