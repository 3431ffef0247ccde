"""From matched recordings to figures."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Self

from tactful.evaluation._labels import EVENT_KINDS, LABEL_KINDS
from tactful.evaluation._match import Match
from tactful.evaluation._outcome import Outcome
from tactful.evaluation._statistics import Rate, Share, Spread
from tactful.recordings import Label


@dataclass(frozen=True, slots=True, kw_only=True)
class ContactFigures:
    """How well a set of contacts was found.

    Attributes:
        recall: how many were found.
        latency_s: from the label's start to the detection [s].
        visible_latency_s: from the moment at which the force can be seen, where labels say it [s].
        onset_error_s: how much later than the label's start the onset was set [s].
        events_per_contact: events on a found contact, on average; 1 is right, nan where none was found.
        link: how many events name the right link, of those that name one where the label does.
        kind: how many have the right kind, of those found whose label tells it.
    """

    recall: Share
    latency_s: Spread
    visible_latency_s: Spread
    onset_error_s: Spread
    events_per_contact: float
    link: Share
    kind: Share

    @property
    def missed(self) -> int:
        """How many were not found."""
        return self.recall.total - self.recall.count

    @classmethod
    def of(cls, matches: Iterable[Match]) -> Self:
        """The figures of some contacts."""
        every = list(matches)
        found = [match for match in every if match.event is not None]
        events = sum(1 + len(match.extra) for match in found)
        return cls(
            recall=Share(len(found), len(every)),
            latency_s=Spread.of(match.latency_s for match in found),
            visible_latency_s=Spread.of(match.visible_latency_s for match in found),
            onset_error_s=Spread.of(match.onset_error_s for match in found),
            events_per_contact=events / len(found) if found else float("nan"),
            link=_share(match.link_right for match in found),
            kind=_share(match.kind_right for match in found),
        )

    def to_dict(self) -> dict[str, Any]:
        """Return plain numbers."""
        return {
            "recall": self.recall.to_dict(),
            "missed": self.missed,
            "latency_s": self.latency_s.to_dict(),
            "visible_latency_s": self.visible_latency_s.to_dict(),
            "onset_error_s": self.onset_error_s.to_dict(),
            "events_per_contact": self.events_per_contact if self.recall.count else None,
            "link": self.link.to_dict(),
            "kind": self.kind.to_dict(),
        }


@dataclass(frozen=True, slots=True)
class Confusion:
    """What the contacts of each labelled kind were called; `counts[label kind][event kind]`, misses beside it."""

    counts: Mapping[str, Mapping[str, int]]
    missed: Mapping[str, int]

    @classmethod
    def of(cls, matches: Iterable[Match]) -> Self:
        """Count, with rows and columns only for the kinds that occur."""
        every = list(matches)
        called: Counter[tuple[str, str]] = Counter(
            (match.label.kind, match.event.kind) for match in every if match.event is not None
        )
        missed = Counter(match.label.kind for match in every if match.event is None)
        rows = [kind for kind in LABEL_KINDS if any(match.label.kind == kind for match in every)]
        columns = [kind for kind in EVENT_KINDS if any(kind == said for _, said in called)]
        return cls(
            {row: {column: called[row, column] for column in columns} for row in rows},
            {row: missed[row] for row in rows},
        )

    def share(self, label_kind: str, event_kind: str) -> Share:
        """How many of the found contacts of a kind were called so."""
        row = self.counts.get(label_kind, {})
        return Share(row.get(event_kind, 0), sum(row.values()))

    def to_dict(self) -> dict[str, Any]:
        """Return plain numbers: each cell as a share of its row."""
        return {
            row: {column: self.share(row, column).to_dict() for column in columns} | {"missed": self.missed[row]}
            for row, columns in self.counts.items()
        }


@dataclass(frozen=True, slots=True, kw_only=True)
class Figures:
    """How good a monitor is on a set of recordings.

    Specificity, sensitivity and accuracy are those of the kinesthetic paper (doi:10.1109/RO-MAN53752.2022.9900800),
    over the contacts that were found.

    Attributes:
        recordings: how many.
        monitored_s: how long [s].
        contact_free_s: how long without a contact [s].
        contacts: how well the contacts were found.
        false_alarms: events that belong to no contact, over the contact-free time.
        alarm_share: part of the contact-free time that lay in a false alarm: one that lasts is one false alarm.
        confusion: what the contacts were called.
        specificity: collisions that were called so.
        sensitivity: cooperations that were called so.
        accuracy: contacts of any labelled kind that were called so.
        spurious_cooperation: recordings with a cooperation event, of those whose contacts are all collisions.
    """

    recordings: int
    monitored_s: float
    contact_free_s: float
    contacts: ContactFigures
    false_alarms: Rate
    alarm_share: float
    confusion: Confusion
    specificity: Share
    sensitivity: Share
    accuracy: Share
    spurious_cooperation: Share

    @classmethod
    def of(cls, outcomes: Iterable[Outcome]) -> Self:
        """The figures of all recordings together: contacts, events and time are pooled."""
        every = list(outcomes)
        matches = [match for outcome in every for match in outcome.matches]
        contacts, confusion = ContactFigures.of(matches), Confusion.of(matches)
        free_s = sum(outcome.contact_free_s for outcome in every)
        collided = [
            outcome
            for outcome in every
            if outcome.matches and all(match.label.kind == "collision" for match in outcome.matches)
        ]
        return cls(
            recordings=len(every),
            monitored_s=sum(outcome.monitored_s for outcome in every),
            contact_free_s=free_s,
            contacts=contacts,
            false_alarms=Rate(sum(len(outcome.false_alarms) for outcome in every), free_s / 3600),
            alarm_share=sum(outcome.alarm_s for outcome in every) / free_s if free_s > 0 else float("nan"),
            confusion=confusion,
            specificity=confusion.share("collision", "collision"),
            sensitivity=confusion.share("cooperation", "cooperation"),
            accuracy=contacts.kind,
            spurious_cooperation=_share(map(_cooperated, collided)),
        )

    def to_dict(self) -> dict[str, Any]:
        """Return plain numbers."""
        return {
            "recordings": self.recordings,
            "monitored_s": self.monitored_s,
            "contact_free_s": self.contact_free_s,
            "contacts": self.contacts.to_dict(),
            "false_alarms": self.false_alarms.to_dict(),
            "alarm_share": self.alarm_share if self.contact_free_s > 0 else None,
            "confusion": self.confusion.to_dict(),
            "specificity": self.specificity.to_dict(),
            "sensitivity": self.sensitivity.to_dict(),
            "accuracy": self.accuracy.to_dict(),
            "spurious_cooperation": self.spurious_cooperation.to_dict(),
        }


def grouped(outcomes: Iterable[Outcome], key: Callable[[Label], str]) -> dict[str, ContactFigures]:
    """Return the figures of each group of contacts, by a name that `key` gives to a label, in the order of the names.

    Example:
        `grouped(outcomes, lambda label: label.kind)`
    """
    groups: dict[str, list[Match]] = {}
    for outcome in outcomes:
        for match in outcome.matches:
            groups.setdefault(key(match.label), []).append(match)
    return {name: ContactFigures.of(groups[name]) for name in sorted(groups)}


def by_operator(outcomes: Iterable[Outcome]) -> dict[str, Figures]:
    """Return the figures of the recordings of each operator, by name; those that name none are left out."""
    every = list(outcomes)
    names = sorted({outcome.operator for outcome in every if outcome.operator is not None})
    return {name: Figures.of(outcome for outcome in every if outcome.operator == name) for name in names}


def _share(answers: Iterable[bool | None]) -> Share:
    given: Sequence[bool] = [answer for answer in answers if answer is not None]
    return Share(sum(given), len(given))


def _cooperated(outcome: Outcome) -> bool:
    events = [event for match in outcome.matches for event in (match.event, *match.extra)]
    return any(event is not None and event.kind == "cooperation" for event in (*events, *outcome.false_alarms))
