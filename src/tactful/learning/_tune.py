"""From labelled recordings to a threshold with a stated guarantee."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np

from tactful import __version__
from tactful.classification import Classifier, Kind, KinestheticClassifier, LearnedClassifier, Onset
from tactful.evaluation import Share
from tactful.learning._decisions import Decision, first_of_each
from tactful.learning._errors import LearningError
from tactful.learning._guarantee import certify, events_needed
from tactful.monitor import MonitorConfig

_GAMMA = tuple(float(f"{value:.3g}") for value in np.geomspace(50.0, 1.8, 40))
_GAMMA_DEG = tuple(float(value) for value in range(90, 2, -3))
_PROBABILITY = (0.999, 0.998, 0.995, 0.99, 0.98, 0.97, *(float(f"{p:.3g}") for p in np.arange(0.95, 0.04, -0.025)))


@dataclass(frozen=True)
class Candidates:
    """What is chosen from: the same classifier with other values of one key of the configuration, the safest first.

    Attributes:
        section: of `MonitorConfig`.
        key: in that section.
        values: of the key. The first calls nearly everything a collision; none depends on data.
        classifiers: one a value.
    """

    section: str
    key: str
    values: tuple[float, ...]
    classifiers: tuple[Classifier, ...]

    @classmethod
    def of(cls, classifier: KinestheticClassifier | LearnedClassifier) -> Candidates:
        """Return the candidates for a classifier: gamma of the rule, or the threshold of the probability."""
        if isinstance(classifier, LearnedClassifier):
            model, how = classifier.model, classifier.config
            thresholds = tuple(
                LearnedClassifier(model, how.model_copy(update={"threshold": value})) for value in _PROBABILITY
            )
            return cls("learned", "threshold", _PROBABILITY, thresholds)
        config = classifier.config
        key, values = ("gamma_deg", _GAMMA_DEG) if config.rule == "angle" else ("gamma", _GAMMA)
        rules = tuple(KinestheticClassifier(config.model_copy(update={key: value})) for value in values)
        return cls("kinesthetic", key, values, rules)

    def ask(self, onset: Onset) -> tuple[Kind, ...]:
        """Return what each of them says of an onset."""
        return tuple(classifier.classify(onset).kind for classifier in self.classifiers)


@dataclass(frozen=True, kw_only=True)
class Tuning:
    """The value of a key that keeps a bound on the collisions that are taken for cooperation.

    Attributes:
        candidates: what was chosen from.
        limit: the bound.
        confidence: with which it holds.
        chosen: number of the candidate that was chosen; None if none keeps the bound.
        misclassified: of each candidate, the collisions that were called cooperation, when they were found or later.
        bounds: of each candidate, the upper bound of that share.
        sensitivity: of each candidate, the cooperations that were called so.
        certified: how many candidates, from the safest on, keep the bound, all at once.
    """

    candidates: Candidates
    limit: float
    confidence: float
    chosen: int | None
    misclassified: tuple[Share, ...]
    bounds: tuple[float, ...]
    sensitivity: tuple[Share, ...]
    certified: int

    @property
    def value(self) -> float | None:
        """The value that was chosen."""
        return None if self.chosen is None else self.candidates.values[self.chosen]

    def applied_to(self, config: MonitorConfig, *, folder: str | Path = ".") -> MonitorConfig:
        """Return settings with the value that was chosen, for a file in a folder."""
        assert self.chosen is not None
        section, key = self.candidates.section, self.candidates.key
        update: dict[str, Any] = {section: getattr(config, section).model_copy(update={key: self.value})}
        if config.classifier_file is not None:
            update["classifier"] = os.path.relpath(config.classifier_file, folder)
        wrong, hits = self.misclassified[self.chosen], self.sensitivity[self.chosen]
        about = {
            "made_by": f"tactful {__version__} tune",
            "made_on": datetime.now(UTC).date().isoformat(),
            "max_misclassified_collisions": self.limit,
            "confidence": self.confidence,
            "misclassified_collisions": f"{wrong.count} of {wrong.total}",
            "cooperations_told": f"{hits.count} of {hits.total}",
        }
        return config.model_copy(update=update | {"provenance": {**config.provenance, "tuning": about}})

    @property
    def shortfall(self) -> str:
        """What it would take, in a sentence, where no candidate keeps the bound; else empty."""
        if self.chosen is not None:
            return ""
        safest = self.misclassified[0]
        needed = events_needed(safest.value, self.limit, self.confidence)
        told = f"{safest.count} of {safest.total} collisions are taken for cooperation at the safest value"
        if needed is None:
            return f"{told}, more than {100 * self.limit:g} %: no number of events helps, another classifier would"
        more = needed - safest.total
        return (
            f"{told}, which bounds their share at {100 * self.bounds[0]:.2f} %: "
            f"{more} more collision{'s are' if more != 1 else ' is'} needed if they come out alike"
        )


def tune(
    decisions: Sequence[Decision[tuple[Kind, ...]]], candidates: Candidates, *, limit: float, confidence: float
) -> Tuning:
    """Choose the value that calls the most contacts rightly, of those that keep a bound on the worst error.

    The error is a collision that is called cooperation, when it is found or later. The bound holds with the stated
    confidence for collisions drawn as those of the recordings were, see `certify`; collisions of one episode, or of one
    operator, are no independent draws, so hold operators out to know what it is worth for others.

    Args:
        decisions: with what each candidate said whenever it was asked, see `Candidates.ask`.
        candidates: what said it.
        limit: largest share of collisions that may be taken for cooperation, in (0, 1).
        confidence: in (0, 1).

    Raises:
        LearningError: if a kind does not occur, or the limit or the confidence is no share.
    """
    for name, share in (("the largest share of misclassified collisions", limit), ("the confidence", confidence)):
        if not 0 < share < 1:
            raise LearningError(f"{name} is {share:g}: it has to lie between 0 and 1")
    first = first_of_each(decisions)
    count = len(candidates.values)
    said = {id(decision): [_told(decision.asks, number) for number in range(count)] for decision in decisions}
    taken: dict[tuple[str, int], list[bool]] = {}
    for decision in decisions:
        if decision.truth == "collision":
            before = taken.get(decision.contact, [False] * count)
            taken[decision.contact] = [
                was or kind == "cooperation" for was, kind in zip(before, said[id(decision)], strict=True)
            ]
    helped = [said[id(decision)] for decision in first if decision.truth == "cooperation"]
    errors = [sum(each[number] for each in taken.values()) for number in range(count)]
    found = [sum(kinds[number] == "cooperation" for kinds in helped) for number in range(count)]
    guarantee = certify(errors, len(taken), limit=limit, confidence=confidence)
    balanced = [hits / len(helped) - wrong / len(taken) for hits, wrong in zip(found, errors, strict=True)]
    certified = guarantee.certified
    return Tuning(
        candidates=candidates,
        limit=limit,
        confidence=confidence,
        chosen=_middle_of_best(balanced[:certified]),
        misclassified=tuple(Share(wrong, len(taken)) for wrong in errors),
        bounds=guarantee.bounds,
        sensitivity=tuple(Share(hits, len(helped)) for hits in found),
        certified=certified,
    )


def _middle_of_best(figures: Sequence[float]) -> int | None:
    """Return the middle one of those that are as good as the best; None of none."""
    if not figures:
        return None
    best = np.flatnonzero(np.isclose(figures, max(figures)))
    return int(best[len(best) // 2])


def _told(asks: Sequence[tuple[Kind, ...]], number: int) -> Kind:
    """Return what a candidate tells in the end: its first answer that is a kind."""
    return next((kinds[number] for kinds in asks if kinds[number] != "contact"), "contact")
