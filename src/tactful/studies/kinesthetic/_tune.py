"""The thresholds of the paper, chosen automatically by its priorities."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from tactful.classification import KinestheticClassifier, KinestheticConfig
from tactful.errors import TactfulError
from tactful.evaluation import Share, Spread
from tactful.studies.kinesthetic._onsets import Note, note_at, onset_of, unit_vectors
from tactful.studies.kinesthetic._watch import THRESHOLDS_N, Row, contact_free_hours, outcome_of

Rule = Literal["floored", "literal", "angle"]
RULES: dict[str, Rule] = {"floored": "floored", "literal": "literal", "angle": "angle"}
GAMMA = tuple(float(f"{value:.3g}") for value in np.geomspace(1.8, 100.0, 50))
GAMMA_DEG = tuple(float(value) for value in range(4, 91, 2))


@dataclass(frozen=True)
class Told:
    """A contact that was found, what the classifier saw of it, and the largest level in the 100 ms that followed."""

    kind: str
    note: Note
    peak_level_n: float


def told(rows: Sequence[Row]) -> list[Told]:
    """Return the contacts that were found, by their first events."""
    found = []
    for row in rows:
        levels = {event["detected_s"]: event["peak_level_n"] for event in row["events"]}
        for match in outcome_of(row).matches:
            if match.event is None:
                continue
            note = note_at(row["asked"], match.event.detected_s)
            if note is not None:
                found.append(Told(match.label.kind, note, levels[match.event.detected_s]))
    return found


def protocol(contacts: Sequence[Told], each: int) -> list[Told]:
    """Return the first so many of each kind."""
    return [c for kind in ("collision", "cooperation") for c in [c for c in contacts if c.kind == kind][:each]]


def force_curve(rows: Sequence[Row]) -> list[dict[str, Any]]:
    """Return what each F_th makes of the episodes: latencies and misses of their first contacts, false alarms."""
    hours, curve = contact_free_hours(rows), []
    touched = [row for row in rows if row["found_s"]]
    for i, threshold in enumerate(THRESHOLDS_N):
        alarms = sum(row["alarms"][i] for row in rows)
        point: dict[str, Any] = {
            "threshold_n": threshold,
            "false_alarms": alarms,
            "false_alarms_per_hour": alarms / hours if hours else None,
        }
        for kind in ("collision", "cooperation"):
            latencies = [row["found_s"][i] for row in touched if row["kind"] == kind]
            missed = sum(latency is None for latency in latencies)
            point[kind] = {
                "missed": missed,
                "contacts": len(latencies),
                "latency_s": Spread.of(latencies).to_dict(),
            }
        curve.append(point)
    return curve


def force_threshold(rows: Sequence[Row]) -> float:
    """Return the least F_th without a false alarm in the episodes: lower ones alarm, higher ones miss more.

    Raises:
        TactfulError: if none of the candidates is without.
    """
    for point in force_curve(rows):
        if not point["false_alarms"]:
            return float(point["threshold_n"])
    raise TactfulError(f"no F_th up to {THRESHOLDS_N[-1]:g} N is without false alarms in the episodes")


def classifier(rule: Rule, value: float) -> KinestheticClassifier:
    """Return a rule with its gamma, in degrees for the angle."""
    key = "gamma_deg" if rule == "angle" else "gamma"
    return KinestheticClassifier(KinestheticConfig(**{"rule": rule, key: value}))


def gamma_curve(contacts: Sequence[Told], rule: Rule) -> list[dict[str, Any]]:
    """Return specificity and sensitivity of a rule for each gamma."""
    onsets = [(contact.kind, onset_of(contact.note)) for contact in contacts]
    curve = []
    for gamma in GAMMA_DEG if rule == "angle" else GAMMA:
        judge = classifier(rule, gamma)
        said = [(kind, judge.classify(onset).kind) for kind, onset in onsets]
        curve.append({"gamma": gamma} | _shares(said))
    return curve


def gamma(contacts: Sequence[Told], rule: Rule) -> float:
    """Return the gamma of the highest specificity and, of these, the highest sensitivity; of equals the middle one."""
    curve = gamma_curve(contacts, rule)
    figures = [(point["specificity"]["count"], point["sensitivity"]["count"]) for point in curve]
    best = [point["gamma"] for point, figure in zip(curve, figures, strict=True) if figure == max(figures)]
    return float(best[len(best) // 2])


def fisher(tuning: Sequence[Told], evaluation: Sequence[Told]) -> dict[str, Any]:
    """Return how well Fisher's linear discriminant on both unit vectors tells the contacts, as the paper compares.

    Raises:
        TactfulError: if scikit-learn is not installed.
    """
    try:
        from sklearn.discriminant_analysis import LinearDiscriminantAnalysis
    except ImportError:
        raise TactfulError('the study needs scikit-learn: pip install "tactful[studies]"') from None
    x = np.array([unit_vectors(contact.note) for contact in tuning])  # (m, 6)
    model = LinearDiscriminantAnalysis().fit(x, [contact.kind for contact in tuning])
    said = model.predict(np.array([unit_vectors(contact.note) for contact in evaluation]))
    return _shares([(contact.kind, str(kind)) for contact, kind in zip(evaluation, said, strict=True)])


def level_alone(tuning: Sequence[Told], evaluation: Sequence[Told]) -> dict[str, Any]:
    """Return how well the level alone tells the contacts: a collision if it gets high, as in refs. 10 and 11.

    The limit is the one that tells the most contacts of the tuning.
    """
    limits = sorted({contact.peak_level_n for contact in tuning})

    def say(contacts: Sequence[Told], limit: float) -> list[tuple[str, str]]:
        return [(c.kind, "collision" if c.peak_level_n >= limit else "cooperation") for c in contacts]

    limit = max(limits, key=lambda limit: sum(kind == said for kind, said in say(tuning, limit)))
    return {"limit_n": limit} | _shares(say(evaluation, limit))


def _shares(said: Sequence[tuple[str, str]]) -> dict[str, Any]:
    def share(kind: str) -> Share:
        answers = [answer for truth, answer in said if truth == kind]
        return Share(answers.count(kind), len(answers))

    return {
        "accuracy": Share(sum(kind == answer for kind, answer in said), len(said)).to_dict(),
        "specificity": share("collision").to_dict(),
        "sensitivity": share("cooperation").to_dict(),
    }
