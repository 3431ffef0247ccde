"""How far a calibration from a few seconds holds on the others."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tactful.calibration._calibrate import Calibration, calibrate
from tactful.errors import TactfulError
from tactful.estimation import MomentumObserver
from tactful.monitor import Monitor, MonitorConfig, Timeline
from tactful.recordings import Recording
from tactful.robots import Robot

Array = NDArray[np.float64]

_SHORTEST_S = 1.0
_SETTLING_S = 0.3


@dataclass(frozen=True, eq=False, kw_only=True)
class Split:
    """A calibration from one part of a recording, and what it does in the rest.

    Attributes:
        start_s, end_s: the part that was calibrated from [s].
        before_nm, after_nm: RMS of the residual in the rest, of the nominal arm as its samples are taken by default,
            and of the calibrated one (n,) [Nm].
        monitored_s: how long the rest is [s].
        false_alarms_s: when the monitor told a contact there [s].
        highest_level: largest statistic of the fast detector there, over its threshold.
    """

    start_s: float
    end_s: float
    before_nm: Array
    after_nm: Array
    monitored_s: float
    false_alarms_s: tuple[float, ...]
    highest_level: float


def cross_validate(
    recording: Recording, config: MonitorConfig, *, window_s: float = 5.0, step_s: float = 1.0
) -> Iterator[Split]:
    """Calibrate from each window of a recording of free motion, and monitor the rest.

    Args:
        recording: with q, dq and tau; nothing touches the arm.
        config: names the arm, as for `calibrate`.
        window_s: length of the windows [s].
        step_s: how far apart they begin [s].

    Raises:
        CalibrationError, TactfulError: as `calibrate`; if the recording is not longer than the window.
    """
    first_s, last_s = float(recording.t[0]), float(recording.t[-1])
    if not last_s - first_s >= window_s + _SHORTEST_S:
        raise TactfulError(
            f"{recording.source}: lasts {last_s - first_s:.3g} s, too short to calibrate from {window_s:g} s and test "
            f"that on the rest: give a window of {max(0.0, last_s - first_s - _SHORTEST_S):.2g} s or less"
        )
    nominal = config.robot.load()
    assert nominal is not None
    for start_s in np.arange(first_s, last_s - window_s + step_s / 2, step_s):
        end_s = float(start_s + window_s)
        end_s = np.inf if end_s > last_s - step_s / 2 else end_s
        found = calibrate([recording.between(float(start_s), end_s)], config)
        rest = [recording.between(a, b) for a, b in ((first_s, float(start_s)), (end_s, np.inf)) if a < b]
        rest = [part for part in rest if len(part) > 1 and part.duration_s >= _SHORTEST_S - 0.01]
        timelines = [Monitor(config=found.config).run(part, trace=True) for part in rest]
        yield Split(
            start_s=float(start_s),
            end_s=min(end_s, last_s),
            before_nm=_rms(rest, nominal, config),
            after_nm=_rms(rest, _robot(found), found.config),
            monitored_s=sum(part.duration_s for part in rest),
            false_alarms_s=tuple(event.detected_s for timeline in timelines for event in timeline.events),
            highest_level=max(_highest(timeline, found.config) for timeline in timelines),
        )


def _highest(timeline: Timeline, config: MonitorConfig) -> float:
    """Return the highest level after the windows have filled."""
    longest = round(config.fast.windows_s[-1] * config.rate_hz)
    assert timeline.trace is not None
    return float(np.nanmax(timeline.trace["level"][longest:, 0]))


def _robot(found: Calibration) -> Robot:
    robot = found.config.robot.load()
    assert robot is not None
    return robot


def _rms(parts: list[Recording], robot: Robot, config: MonitorConfig) -> Array:
    residuals = []
    for part in parts:
        forward = np.append(True, np.diff(np.maximum.accumulate(part.t)) > 0)
        q, dq, tau = (part.channels[name][forward] for name in ("q", "dq", "tau"))
        r = MomentumObserver(robot, config.observer).run(part.t[forward], q, dq, tau)
        residuals.append(r[part.t[forward] > part.t[0] + _SETTLING_S])
    return np.asarray(np.sqrt(np.mean(np.concatenate(residuals) ** 2, axis=0)))
