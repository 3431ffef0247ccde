"""Levels of the detectors in free motion, and the thresholds that follow from them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from tactful.calibration._errors import CalibrationError
from tactful.calibration._threshold import Threshold, support, threshold_for_rate
from tactful.estimation import ObserverConfig
from tactful.monitor import Monitor, MonitorConfig
from tactful.recordings import Recording
from tactful.robots import Robot

Array = NDArray[np.float64]


class Free(Protocol):
    """Time in which nothing touches an arm that was not fitted to it."""

    @property
    def recording(self) -> Recording:
        """What was recorded."""
        ...

    @property
    def robot(self) -> Robot | None:
        """The arm."""
        ...

    @property
    def observer(self) -> ObserverConfig:
        """Its observer."""
        ...

    def counts(self, settling_s: float) -> NDArray[np.bool_]:
        """Return which samples count for something that settles in `settling_s` (k,)."""
        ...


_PEAKS = 16
"""Spans that a short recording is at least divided into: half of their peaks tell the tail."""
_UNSEEN_S = 1.5
"""Time over which motion sees one pose and speed, and nothing of the others [s]."""
_FEW_S, _JERK_S = 2.5, 0.05
"""Time below which the upper end of the interval counts, for windows up to the second [s]."""
_REST_RAD_S, _REST_S = 0.05, 0.3
"""An arm whose joints are slower than this for so long stands still."""
_NEVER = 1e9
"""A threshold that nothing reaches."""


def glr_thresholds(parts: Sequence[Free], config: MonitorConfig, false_alarms_per_hour: float) -> tuple[Threshold, ...]:
    """Return a threshold for each window of the fast detector; together they alarm at the stated rate.

    None is below that of noise as it is modelled, of a chi distribution: lower levels in a short recording are luck.
    And few seconds see few poses, where the error of the model may be smaller than elsewhere: the variance is taken to
    be 1 + 1.5 s / T times as large after a time T. A time that is shorter still has seen few jerks, as when an arm
    stops: for short windows the upper end of the interval counts.

    Args:
        parts: free motion that the arms were not calibrated to.
        config: the settings, with the noise.
        false_alarms_per_hour: the stated rate [1/h].
    """
    windows_s, channels = config.fast.windows_s, len(np.atleast_1d(np.asarray(config.noise.model_nm)))
    lengths = [max(1, round(window_s * config.rate_hz)) for window_s in windows_s]
    found: dict[int, Threshold] = {}
    for length in dict.fromkeys(lengths):
        alone = tuple(_NEVER if other == length else _NEVER**2 for other in lengths)
        fast = config.fast.model_copy(update={"threshold": alone})
        level = _levels(parts, config.model_copy(update={"mode": "fast", "fast": fast}), 2 * config.fast.drift_s)[:, 0]
        rate = false_alarms_per_hour / len(set(lengths))
        threshold = _threshold(_NEVER * level, config.rate_hz, rate, windows_s[-1])
        least = math.sqrt(chi2.isf(rate / 3600 * length / config.rate_hz, channels))
        unseen = math.sqrt(1 + _UNSEEN_S * config.rate_hz / len(level))
        levels = {key: unseen * max(least, getattr(threshold, key)) for key in ("low", "value", "high")}
        if len(level) < _FEW_S * config.rate_hz and length <= _JERK_S * config.rate_hz:
            levels["value"] = levels["high"]
        ratio = levels["value"] / float(_NEVER * level.max())
        supported, statement = support(false_alarms_per_hour, len(level) / config.rate_hz, ratio)
        found[length] = replace(threshold, supported=supported, statement=statement, **levels)
    return tuple(found[length] for length in lengths)


def frequency_thresholds(
    parts: Sequence[Free], config: MonitorConfig, false_alarms_per_hour: float
) -> tuple[Threshold, ...]:
    """Return F_th of the frequency detector for x, y and z; together they alarm at the stated rate."""
    frequency = config.frequency.model_copy(update={"threshold_n": _NEVER})
    level = _levels(
        parts,
        config.model_copy(update={"mode": "paper", "frequency": frequency}),
        config.frequency.window / config.rate_hz + 0.2,
    )
    separation_s = config.frequency.window / config.rate_hz / 2
    return tuple(_threshold(level[:, i], config.rate_hz, false_alarms_per_hour / 3, separation_s) for i in range(3))


def _threshold(level: Array, rate_hz: float, false_alarms_per_hour: float, separation_s: float) -> Threshold:
    """Return the threshold of a level; where it is short, peaks need not be that far apart."""
    separation_s = min(separation_s, len(level) / rate_hz / _PEAKS)
    return threshold_for_rate(level, rate_hz, false_alarms_per_hour, separation_s=separation_s, amplitude=True)


def _levels(parts: Sequence[Free], config: MonitorConfig, settling_s: float) -> Array:
    """Return the levels of a detector where they count, without the time in which it settles."""
    levels = []
    for part in parts:
        monitor = Monitor(part.robot, config.model_copy(update={"observer": part.observer}))
        counts = part.counts(_settled_s(part.recording, settling_s))
        levels.append(monitor.run(part.recording, trace=True).trace["level"][counts])
    if not sum(len(level) for level in levels):
        raise CalibrationError(
            parts[0].recording.source, "is too short for the detectors to settle: record 5 s or more"
        )
    return np.concatenate(levels)


def _settled_s(recording: Recording, settling_s: float) -> float:
    """Return how long a detector takes to settle [s]: less where the arm stands still, so that setting off counts."""
    if recording.dq is None:
        return settling_s
    moves = np.flatnonzero(np.abs(recording.dq).max(axis=1) > _REST_RAD_S)
    still_s = float(recording.t[moves[0]] - recording.t[0]) if len(moves) else settling_s
    return min(settling_s, _REST_S) if still_s >= _REST_S else settling_s
