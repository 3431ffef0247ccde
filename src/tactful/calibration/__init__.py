"""From recordings of free motion to the configuration of a monitor."""

from tactful.calibration._calibrate import Calibration, calibrate
from tactful.calibration._cross_validate import Split, cross_validate
from tactful.calibration._errors import CalibrationError
from tactful.calibration._fit import Fit
from tactful.calibration._sensors import fit_sensors
from tactful.calibration._threshold import Threshold, threshold_for_rate

__all__ = [
    "Calibration",
    "CalibrationError",
    "Fit",
    "Split",
    "Threshold",
    "calibrate",
    "cross_validate",
    "fit_sensors",
    "threshold_for_rate",
]
