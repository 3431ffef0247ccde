"""Levels of the detectors in free motion, and the thresholds that follow from them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from tactful.calibration._errors import CalibrationError
from tactful.calibration._motion import HeldOut
from tactful.calibration._threshold import Threshold, threshold_for_rate
from tactful.monitor import Monitor, MonitorConfig
from tactful.recordings import Recording

Array = NDArray[np.float64]

_NEVER = 1e9
"""A threshold that nothing reaches."""


def glr_thresholds(
    parts: Sequence[HeldOut], config: MonitorConfig, false_alarms_per_hour: float
) -> tuple[Threshold, ...]:
    """Return a threshold for each window of the fast detector; together they alarm at the stated rate.

    Args:
        parts: free motion that the arms were not calibrated to.
        config: the settings, with the noise.
        false_alarms_per_hour: the stated rate [1/h].
    """
    windows_s = config.fast.windows_s
    lengths = [max(1, round(window_s * config.rate_hz)) for window_s in windows_s]
    found: dict[int, Threshold] = {}
    for length in dict.fromkeys(lengths):
        threshold = tuple(1.0 if other == length else _NEVER for other in lengths)
        fast = config.fast.model_copy(update={"threshold": tuple(_NEVER * level for level in threshold)})
        level = _levels(parts, config.model_copy(update={"mode": "fast", "fast": fast}), 2 * config.fast.drift_s)[:, 0]
        found[length] = threshold_for_rate(
            _NEVER * level,
            config.rate_hz,
            false_alarms_per_hour / len(set(lengths)),
            separation_s=windows_s[-1],
            amplitude=True,
        )
    return tuple(found[length] for length in lengths)


def frequency_thresholds(
    parts: Sequence[HeldOut], config: MonitorConfig, false_alarms_per_hour: float
) -> tuple[Threshold, ...]:
    """Return F_th of the frequency detector for x, y and z; together they alarm at the stated rate."""
    frequency = config.frequency.model_copy(update={"threshold_n": _NEVER})
    level = _levels(
        parts,
        config.model_copy(update={"mode": "paper", "frequency": frequency}),
        config.frequency.window / config.rate_hz + 0.2,
    )
    separation_s = config.frequency.window / config.rate_hz / 2
    return tuple(
        threshold_for_rate(
            level[:, i], config.rate_hz, false_alarms_per_hour / 3, separation_s=separation_s, amplitude=True
        )
        for i in range(3)
    )


def _levels(parts: Sequence[HeldOut], config: MonitorConfig, settling_s: float) -> Array:
    """Return the levels of a detector where they count, without the time in which it settles."""
    levels = []
    for part in parts:
        stretch = part.stretch
        recording = Recording(stretch.t, {"q": stretch.q, "dq": stretch.dq, "tau": stretch.tau}, source=stretch.source)
        monitor = Monitor(part.robot, config.model_copy(update={"observer": part.observer}))
        levels.append(monitor.run(recording, trace=True).trace["level"][part.counts(settling_s)])
    if not sum(len(level) for level in levels):
        raise CalibrationError(parts[0].stretch.source, "is too short for the detectors to settle: record 5 s or more")
    return np.concatenate(levels)
