"""From what a monitor said of episodes to its figures."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import Any

from tactful.evaluation import ContactFigures, Figures, Match, Outcome, Rate, Share, Spread
from tactful.simulation import OPERATORS
from tactful.studies.kinesthetic._watch import Row, outcome_of

STRONG_N = 6.0
"""Peak force from which no contact is to be missed [N]."""


def block(rows: Sequence[Row], free: Sequence[Row]) -> dict[str, Any]:
    """Return the figures of a monitor.

    Args:
        rows: its episodes with contacts.
        free: its episodes without.
    """
    pairs = [(row, outcome_of(row)) for row in rows]
    outcomes = [outcome for _, outcome in pairs]
    figures = Figures.of(outcomes)
    of_kind = {
        kind: [match for outcome in outcomes for match in outcome.matches if match.label.kind == kind]
        for kind in ("collision", "cooperation")
    }
    during = {id(m) for outcome in outcomes for m in outcome.matches if _during_another(m, outcome.matches)}
    per_operator = _per_operator(pairs)
    rates = [share["value"] for share in per_operator.values() if share["value"] is not None]
    block: dict[str, Any] = {
        "episodes": len(rows),
        "contacts": figures.contacts.recall.total,
        "accuracy": figures.accuracy.to_dict(),
        "specificity": figures.specificity.to_dict(),
        "sensitivity": figures.sensitivity.to_dict(),
        "confusion": figures.confusion.to_dict(),
        "misses": misses(outcomes),
        "false_alarms_per_hour": false_alarms(free).to_dict(),
        "false_alarms_between_contacts": figures.false_alarms.to_dict(),
        "spurious_cooperation_rate": figures.spurious_cooperation.to_dict(),
        "events_per_contact": figures.contacts.to_dict()["events_per_contact"],
        "per_operator": per_operator,
        "operator_sd": Spread.of(rates).to_dict()["sd"],
    }
    for kind, matches in of_kind.items():
        contacts = ContactFigures.of(matches)
        block[f"{kind}_latency_ms"] = _milliseconds(contacts.latency_s)
        block[f"{kind}_latency_from_1_n_ms"] = _milliseconds(contacts.visible_latency_s)
        alone = ContactFigures.of(match for match in matches if id(match) not in during)
        block[f"{kind}_alone"] = {
            "recall": alone.recall.to_dict(),
            "latency_ms": _milliseconds(alone.latency_s),
        }
    return block


def false_alarms(free: Sequence[Row]) -> Rate:
    """Return the events in contact-free motion, by the hour."""
    hours = sum(row["monitored_s"] for row in free) / 3600
    return Rate(sum(len(row["events"]) for row in free), hours)


def misses(outcomes: Iterable[Outcome]) -> dict[str, Any]:
    """Return the contacts that no event found, and how many of them began while something else touched the arm.

    A collision that begins while the monitor tells a collision, or a contact, is no miss but more of the same: it is
    `continued`. A cooperation in that case is missed, because nobody learns that a person is there.
    """
    every = list(outcomes)
    matches = [match for outcome in every for match in outcome.matches]
    during = [m for outcome in every for m in outcome.matches if _during_another(m, outcome.matches)]
    missed = [(outcome, match) for outcome in every for match in outcome.matches if match.event is None]
    continued = [match for outcome, match in missed if _continued(outcome, match)]
    lost = [match for outcome, match in missed if not _continued(outcome, match)]
    strong = [match for match in lost if _peak(match) >= STRONG_N]
    total_strong = sum(_peak(match) >= STRONG_N for match in matches)
    return {
        "missed": Share(len(lost), len(matches)).to_dict(),
        "from_6_n": Share(len(strong), total_strong).to_dict(),
        "collisions": sum(match.label.kind == "collision" for match in lost),
        "cooperations": sum(match.label.kind == "cooperation" for match in lost),
        "during_another": sum(any(match is other for other in during) for match in lost),
        "strongest_n": max((_peak(match) for match in lost), default=None),
        "continued": len(continued),
    }


def _peak(match: Match) -> float:
    peak = match.label.peak_force_n
    return math.inf if peak is None else peak


def _during_another(match: Match, matches: Sequence[Match]) -> bool:
    start = match.label.start_s
    return any(o.label is not match.label and o.label.start_s <= start <= o.label.end_s for o in matches)


def _continued(outcome: Outcome, match: Match) -> bool:
    if match.label.kind != "collision":
        return False
    events = [event for other in outcome.matches for event in (other.event, *other.extra) if event is not None]
    start = match.label.start_s
    return any(
        event.kind in ("collision", "contact") and event.detected_s <= start and (event.end_s or math.inf) >= start
        for event in events
    )


def _per_operator(pairs: Sequence[tuple[Row, Outcome]]) -> dict[str, Any]:
    """Return the sensitivity of each operator, as in Table II."""
    shares = {}
    for name in OPERATORS:
        found = [
            match.kind_right
            for row, outcome in pairs
            if row["spec"]["operator"] == name
            for match in outcome.matches
            if match.label.kind == "cooperation" and match.event is not None
        ]
        if found:
            shares[name] = Share(sum(map(bool, found)), len(found)).to_dict()
    return shares


def _milliseconds(spread: Spread) -> dict[str, Any]:
    numbers = spread.to_dict()
    return {key: value if key == "n" or value is None else 1e3 * value for key, value in numbers.items()}


def confusion(rows: Sequence[Row], collisions: int, cooperations: int) -> dict[str, Any]:
    """Return Tables I and II over the first so many contacts of each kind that were found."""
    left = {"collision": collisions, "cooperation": cooperations}
    counts: dict[str, dict[str, int]] = {kind: {"collision": 0, "cooperation": 0, "contact": 0} for kind in left}
    operators: dict[str, dict[str, int]] = {}
    for row in rows:
        for match in outcome_of(row).matches:
            kind = match.label.kind
            if match.event is None or not left[kind]:
                continue
            left[kind] -= 1
            counts[kind][match.event.kind] += 1
            if kind == "cooperation":
                said = operators.setdefault(row["spec"]["operator"], {"collision": 0, "cooperation": 0, "contact": 0})
                said[match.event.kind] += 1
    right = counts["collision"]["collision"] + counts["cooperation"]["cooperation"]
    total = sum(sum(row.values()) for row in counts.values())
    return {
        "counts": counts,
        "operators": dict(sorted(operators.items())),
        "accuracy": Share(right, total).to_dict(),
        "specificity": _share(counts, "collision"),
        "sensitivity": _share(counts, "cooperation"),
    }


def _share(counts: dict[str, dict[str, int]], kind: str) -> dict[str, Any]:
    return Share(counts[kind][kind], sum(counts[kind].values())).to_dict()


def grouped(rows: Sequence[Row], key: str) -> dict[str, dict[str, Any]]:
    """Return short figures for each value of a key of the specs."""
    values = sorted({str(row["spec"][key]) for row in rows})
    return {value: short([row for row in rows if str(row["spec"][key]) == value]) for value in values}


def short(rows: Sequence[Row]) -> dict[str, Any]:
    """Return the figures that depend on few episodes least."""
    whole = block(rows, [])
    keys = (
        "accuracy",
        "specificity",
        "sensitivity",
        "spurious_cooperation_rate",
        "misses",
        "false_alarms_between_contacts",
    )
    return {key: whole[key] for key in keys} | {
        f"{kind}_latency_ms": whole[f"{kind}_latency_ms"] for kind in ("collision", "cooperation")
    }


def transitions(rows: Sequence[Row]) -> dict[str, Any]:
    """Return how collisions end and what becomes of a collision that follows a cooperation."""
    ended, late, second = [], [], []
    for row in rows:
        outcome = outcome_of(row)
        for match in outcome.matches:
            if match.event is None or match.label.kind != "collision":
                continue
            alone = not _during_another(match, [m for m in outcome.matches if m is not match])
            if alone and match.label.end_s < row["end_s"] - 0.5:
                ended.append(match.event.end_s is not None)
                if match.event.end_s is not None:
                    late.append(match.event.end_s - match.label.end_s)
        second += _after_cooperation(outcome)
    return {
        "collision_to_free": Share(sum(ended), len(ended)).to_dict(),
        "told_after_ms": _milliseconds(Spread.of(late)),
        "cooperation_to_collision": {
            name: Share(sum(said == "collision" for said in answers), len(answers)).to_dict()
            for name, answers in (
                ("hand_still_there", [said for during, said in second if during]),
                ("hand_gone", [said for during, said in second if not during]),
            )
        },
    }


def _after_cooperation(outcome: Outcome) -> list[tuple[bool, str]]:
    """Return of each collision after a cooperation whether the hand was still there, and what it was called."""
    hands = [match.label for match in outcome.matches if match.label.kind == "cooperation"]
    found: list[tuple[bool, str]] = []
    for match in outcome.matches:
        if match.label.kind != "collision" or not any(hand.start_s < match.label.start_s for hand in hands):
            continue
        during = any(hand.start_s <= match.label.start_s <= hand.end_s for hand in hands)
        found.append((during, "missed" if match.event is None else match.event.kind))
    return found
