"""Which event is which contact."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from tactful.evaluation._labels import tells_kind
from tactful.monitor import ContactEvent
from tactful.recordings import Label

EARLY_S = 0.05
"""How long before the start of its label an event may be detected: labels are not exact [s]."""
LATE_S = 0.2
"""How long after the end of its label an event may be detected: an impact is over before it is seen [s]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Match:
    """A labelled contact and what the monitor said of it.

    Attributes:
        label: the contact.
        event: the event that found it, None if it was missed.
        extra: further events on the same contact, in the order of their detection.
        link_name: the name of the labelled link, None where it is not known.
    """

    label: Label
    event: ContactEvent | None
    extra: tuple[ContactEvent, ...] = ()
    link_name: str | None = None

    @property
    def latency_s(self) -> float | None:
        """Time from the label's start to the detection [s]; None if missed."""
        return None if self.event is None else self.event.detected_s - self.label.start_s

    @property
    def visible_latency_s(self) -> float | None:
        """Time from the moment at which the force could be seen to the detection [s]; None where it is not labelled."""
        visible_s = self.label.visible_s
        return None if self.event is None or visible_s is None else self.event.detected_s - visible_s

    @property
    def onset_error_s(self) -> float | None:
        """How much later than the label's start the event's onset lies [s]; None if missed."""
        return None if self.event is None else self.event.onset_s - self.label.start_s

    @property
    def link_right(self) -> bool | None:
        """Whether the event names the labelled link; None if missed or if either does not say."""
        if self.event is None or self.event.link is None or self.link_name is None:
            return None
        return self.event.link == self.link_name

    @property
    def kind_right(self) -> bool | None:
        """Whether the event has the labelled kind; None if missed or if the label does not say.

        An event that is not classified is not right.
        """
        return None if self.event is None or not tells_kind(self.label) else self.event.kind == self.label.kind


@dataclass(frozen=True, slots=True)
class Matching:
    """All contacts of a recording, by their start, and the events that belong to none."""

    matches: tuple[Match, ...]
    false_alarms: tuple[ContactEvent, ...]


def label_at(
    detected_s: float, labels: Sequence[Label], *, early_s: float = EARLY_S, late_s: float = LATE_S
) -> int | None:
    """Return the number of the label to which a detection belongs, see `match_events`; None for none."""
    near = [
        (max(label.start_s - detected_s, detected_s - label.end_s, 0.0), -label.start_s, number)
        for number, label in enumerate(labels)
        if label.start_s - early_s <= detected_s <= label.end_s + late_s
    ]
    return min(near)[-1] if near else None


def match_events(
    events: Iterable[ContactEvent],
    labels: Iterable[Label],
    *,
    early_s: float = EARLY_S,
    late_s: float = LATE_S,
    link_names: Sequence[str] = (),
) -> Matching:
    """Match events to labels, one to one.

    An event belongs to a label if it was detected within [start_s - early_s, end_s + late_s]; to the nearest in time
    where there are several; to the one that started last where it lies in several, as a new event has a new cause. The
    earliest event of a label finds it, the others are extra. An event of no label is a false alarm. One that began
    before the window and goes on through it finds nothing: nobody could have told the contact from it.

    Args:
        events: the events of one recording, in any order.
        labels: its labels, in any order.
        early_s: see above [s].
        late_s: see above [s].
        link_names: the names of the arm's links, for `Match.link_right`.
    """
    ordered = sorted(
        labels, key=lambda label: (label.start_s, label.end_s, label.kind, -1 if label.link is None else label.link)
    )
    found: list[list[ContactEvent]] = [[] for _ in ordered]
    false_alarms: list[ContactEvent] = []
    for event in sorted(events, key=lambda event: (event.detected_s, event.onset_s, event.id)):
        number = label_at(event.detected_s, ordered, early_s=early_s, late_s=late_s)
        (false_alarms if number is None else found[number]).append(event)
    return Matching(
        tuple(
            Match(
                label=label,
                event=mine[0] if mine else None,
                extra=tuple(mine[1:]),
                link_name=link_names[label.link] if label.link is not None and label.link < len(link_names) else None,
            )
            for label, mine in zip(ordered, found, strict=True)
        ),
        tuple(false_alarms),
    )
