"""One recording, evaluated."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tactful.evaluation._labels import check_labels
from tactful.evaluation._match import EARLY_S, LATE_S, Match, Matching, match_events
from tactful.evaluation._operator import operator_of
from tactful.monitor import ContactEvent, Timeline
from tactful.recordings import Recording

Spans = list[tuple[float, float]]


@dataclass(frozen=True, slots=True, kw_only=True)
class Outcome:
    """What a monitor found in a recording, against what is there.

    Attributes:
        source: the recording.
        matches: its labelled contacts.
        false_alarms: the events that belong to none.
        monitored_s: time that the monitor saw, without gaps [s].
        contact_free_s: that time without the labels and the tolerance around them, in which no event belongs [s].
        alarm_s: how much of the latter lay in a false alarm [s].
        operator: who touched the arm, as far as the recording says, see `operator_of`.
    """

    source: str
    matches: tuple[Match, ...]
    false_alarms: tuple[ContactEvent, ...]
    monitored_s: float
    contact_free_s: float
    alarm_s: float
    operator: str | None = None

    @property
    def found(self) -> int:
        """How many contacts were found."""
        return sum(match.event is not None for match in self.matches)

    def to_dict(self) -> dict[str, Any]:
        """Return plain numbers, strings and lists."""
        return {
            "source": self.source,
            "operator": self.operator,
            "monitored_s": self.monitored_s,
            "contact_free_s": self.contact_free_s,
            "alarm_s": self.alarm_s,
            "contacts": [
                match.label.to_dict()
                | {
                    "detected_s": match.event.detected_s if match.event else None,
                    "onset_s": match.event.onset_s if match.event else None,
                    "called": match.event.kind if match.event else None,
                    "called_link": match.event.link if match.event else None,
                    "extra_events": len(match.extra),
                }
                for match in self.matches
            ],
            "false_alarms": [
                {"detected_s": event.detected_s, "end_s": event.end_s, "called": event.kind}
                for event in self.false_alarms
            ],
        }


def evaluate(
    recording: Recording,
    timeline: Timeline,
    *,
    link_names: Sequence[str] = (),
    early_s: float = EARLY_S,
    late_s: float = LATE_S,
) -> Outcome:
    """Hold the events of a recording against its labels; without labels it is taken as free of contact.

    Args:
        recording: what was monitored, with its labels.
        timeline: what the monitor found in it.
        link_names: the names of the arm's links, to judge the link of an event.
        early_s: how long before a label its event may be detected, see `match_events` [s].
        late_s: how long after it [s].

    Raises:
        EvaluationError: a label does not fit the recording.
    """
    check_labels(recording, links=len(link_names) or None)
    matching: Matching = match_events(timeline, recording.labels, early_s=early_s, late_s=late_s, link_names=link_names)
    steps = _steps(recording, timeline)
    windows = [(label.start_s - early_s, label.end_s + late_s) for label in recording.labels]
    alarms = [
        (event.detected_s, timeline.end_s if event.end_s is None else event.end_s) for event in matching.false_alarms
    ]
    labelled_s = _covered_s(windows, steps)
    monitored_s = float(np.diff(steps).sum())
    return Outcome(
        source=recording.source,
        matches=matching.matches,
        false_alarms=matching.false_alarms,
        monitored_s=monitored_s,
        contact_free_s=monitored_s - labelled_s,
        alarm_s=_covered_s(windows + alarms, steps) - labelled_s,
        operator=operator_of(recording),
    )


def _steps(recording: Recording, timeline: Timeline) -> NDArray[np.float64]:
    """Return the beginnings and ends (k, 2) of the steps in time that are no gaps to the monitor [s]."""
    t = np.maximum.accumulate(recording.t[np.isfinite(recording.t)])
    steps = np.column_stack([t[:-1], t[1:]])  # (k, 2)
    longest_s = max(timeline.config.contact.gap_s, 5 / timeline.config.rate_hz)
    return steps[np.diff(steps)[:, 0] <= longest_s]


def _covered_s(spans: Spans, steps: NDArray[np.float64]) -> float:
    """Return how much of the steps (k, 2) lies in the union of the spans [s]."""
    united: list[list[float]] = []
    for start, end in sorted(spans):
        if united and start <= united[-1][1]:
            united[-1][1] = max(united[-1][1], end)
        else:
            united.append([start, end])
    if not united:
        return 0.0
    edges = np.array(united)  # (m, 2)
    before = np.concatenate([[0.0], np.cumsum(np.diff(edges)[:, 0])])  # covered before each span, and after all
    covered = np.column_stack([before[:-1], before[1:]])  # (m, 2)
    at = np.interp(steps, edges.ravel(), covered.ravel())  # (k, 2)
    return float(np.diff(at).sum())
