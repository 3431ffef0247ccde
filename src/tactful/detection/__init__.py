"""Is there contact."""

from tactful.detection._config import ContactConfig, FastConfig, FrequencyConfig, NoiseConfig
from tactful.detection._frequency import AXES, frequency_arrays, thresholds

__all__ = ["AXES", "ContactConfig", "FastConfig", "FrequencyConfig", "NoiseConfig", "frequency_arrays", "thresholds"]
