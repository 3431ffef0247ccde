"""Is there contact."""

from tactful.detection._config import ContactConfig, FrequencyConfig
from tactful.detection._frequency import AXES, frequency_arrays, thresholds

__all__ = ["AXES", "ContactConfig", "FrequencyConfig", "frequency_arrays", "thresholds"]
