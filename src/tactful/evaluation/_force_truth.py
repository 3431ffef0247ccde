"""Truth from a force/torque sensor."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tactful.evaluation._errors import EvaluationError
from tactful.evaluation._identified import identified_force
from tactful.evaluation._labels import VISIBLE_N
from tactful.monitor import Timeline
from tactful.recordings import Label, Recording
from tactful.robots import Robot

Array = NDArray[np.float64]

_BEFORE_S, _GUARD_S = 0.5, 0.1
"""The force without a contact is the mean over the first of them, which ends the second before the contact [s]."""


def labels_from_wrench(
    recording: Recording, *, threshold_n: float = VISIBLE_N, low_n: float = 0.2, debounce_s: float = 0.1
) -> tuple[Label, ...]:
    """Return the contacts that the force/torque sensor of a recording shows, as labels of the kind `contact`.

    A contact is a stretch in which |F| passes the threshold in at least two rows. It reaches, backwards and forwards,
    as far as |F| stays above the low level; pauses that are shorter than the debouncing time are part of it. `start_s`
    is the first row above the low level, `visible_s` the first above the threshold, `end_s` the last above the low one.

    Args:
        recording: with the channel `wrench_ft`, which reads zero without contact.
        threshold_n: the force that makes a contact [N].
        low_n: the force at which it begins and ends, above the sensor's noise [N].
        debounce_s: how long the force has to stay below the low level for the contact to be over [s].

    Raises:
        EvaluationError: there is no such channel, or the levels are not in order.
    """
    force, t = _ft_force(recording)
    if not 0 < low_n <= threshold_n or not debounce_s >= 0:
        raise EvaluationError(
            f"low_n is {low_n:g}, threshold_n {threshold_n:g} and debounce_s {debounce_s:g}: "
            "they have to be positive, the threshold not below the low level"
        )
    good = np.isfinite(force).all(axis=1) & (t >= np.fmax.accumulate(t))  # time does not run backward
    t, magnitude = t[good], np.linalg.norm(force[good], axis=1)  # 2 x (k,)
    touched = np.flatnonzero(magnitude > low_n)
    if not len(touched):
        return ()
    labels = []
    for rows in np.split(touched, np.flatnonzero(np.diff(t[touched]) > debounce_s) + 1):
        visible = rows[magnitude[rows] > threshold_n]
        if len(visible) >= 2:
            labels.append(
                Label(
                    "contact",
                    float(t[rows[0]]),
                    float(t[rows[-1]]),
                    visible_s=float(t[visible[0]]),
                    peak_force_n=float(magnitude[rows].max()),
                )
            )
    return tuple(labels)


@dataclass(frozen=True, slots=True)
class ForceError:
    """How far an estimated force lies from that of a force/torque sensor during contacts, per axis.

    Attributes:
        rows: number of rows compared.
        rms_n: root mean square of the difference (3,) [N].
        mean_n: its mean (3,) [N].
        identified_n: root mean square over all rows of the difference between the force that the recording's torque
            tells, see `identified_force`, and the measured one (3,) [N]; None where the recording has no such channels.
    """

    rows: int
    rms_n: tuple[float, ...]
    mean_n: tuple[float, ...]
    identified_n: tuple[float, ...] | None = None

    def to_dict(self) -> dict[str, Any]:
        """Return plain numbers."""
        identified = None if self.identified_n is None else list(self.identified_n)
        return {"rows": self.rows, "rms_n": list(self.rms_n), "mean_n": list(self.mean_n), "identified_n": identified}


def force_error(recording: Recording, timeline: Timeline, robot: Robot | None = None) -> ForceError:
    """Compare what the labelled contacts added to the estimated force with what they added to the measured one.

    Of both, the mean over the 0.5 s before a contact, up to 0.1 s before it, is taken as the force without it. Both
    have to stand in the same axes, and the sensor has to carry all of the contact.

    Args:
        recording: with the channel `wrench_ft` and labels.
        timeline: what the monitor made of it, with the trace.
        robot: the arm, for what its torque tells, see `identified_force`.

    Raises:
        EvaluationError: the sensor's channel or the trace is not there, or there is no contact to compare.
    """
    if timeline.trace is None:
        raise EvaluationError("the timeline has no trace: run(recording, trace=True)", source=recording.source)
    measured, _ = _ft_force(recording)
    good = np.isfinite(measured).all(axis=1) & np.isfinite(timeline.trace["t"])  # not those that were skipped
    t, measured, estimated = recording.t[good], measured[good], timeline.trace["wrench"][good, :3]  # (k,), 2 x (k, 3)
    differences = []
    for label in recording.labels:
        inside = (t >= label.start_s) & (t <= label.end_s)
        before = (t >= label.start_s - _GUARD_S - _BEFORE_S) & (t <= label.start_s - _GUARD_S)
        if inside.any() and before.any():
            zero = (estimated[before] - measured[before]).mean(axis=0)
            differences.append(estimated[inside] - measured[inside] - zero)
    if not differences:
        raise EvaluationError("it has no labelled contact whose force could be compared", source=recording.source)
    error = np.concatenate(differences)  # (k, 3)
    rms, mean = np.sqrt(np.mean(error**2, axis=0)), error.mean(axis=0)
    identified = identified_force(recording, timeline, robot)
    told = None
    if identified is not None:
        told = tuple(np.sqrt(np.nanmean((identified[good] - measured) ** 2, axis=0)).tolist())
    return ForceError(len(error), tuple(map(float, rms)), tuple(map(float, mean)), told)


def _ft_force(recording: Recording) -> tuple[Array, Array]:
    """Return the measured force (N, 3) [N] and the times (N,) [s]."""
    wrench = recording.channels.get("wrench_ft")
    if wrench is None:
        raise EvaluationError(
            f"no force/torque sensor was recorded: wrench_ft is not among {', '.join(recording.channels)}",
            source=recording.source,
        )
    return wrench[:, :3], recording.t
