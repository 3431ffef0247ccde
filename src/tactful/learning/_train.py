"""From labelled recordings to a classifier."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tactful import __version__
from tactful.classification import FEATURES, AdditiveModel, LearnedConfig, Onset, measured
from tactful.evaluation import Share
from tactful.learning._decisions import Decision, first_of_each
from tactful.learning._errors import LearningError
from tactful.learning._fit import Curves, Groups, Rows, fit

Array = NDArray[np.float64]

_LEAST = 10
"""Contacts of each kind without which nothing is learned."""
_THRESHOLDS = tuple(round(0.5 + 0.05 * k, 2) for k in range(9))
"""What is chosen from: nobody is called a helper who is less probable than an obstacle."""


@dataclass(frozen=True, kw_only=True)
class Training:
    """A trained model, and how good it is on those it has not seen.

    Attributes:
        model: the model, of all data.
        held_out: what was held out in turn: "operator" or "recording".
        collisions: how many contacts are collisions, how many cooperation.
        cooperations: how many are cooperation.
        accuracy: contacts that were told rightly when they were held out.
        specificity: collisions that were.
        sensitivity: cooperations that were.
        spurious: collisions that were called cooperation then, when they were found or later.
        per_operator: accuracy on the recordings of each operator; empty where the recordings do not name any.
        told: what was told of each decision when it was held out, in their order.
        decided_s: mean time from the detection to the decision [s].
        importance: mean magnitude of what each feature adds to the log odds, the largest first.
    """

    model: AdditiveModel
    held_out: str
    collisions: int
    cooperations: int
    accuracy: Share
    specificity: Share
    sensitivity: Share
    spurious: Share
    per_operator: Mapping[str, Share]
    told: tuple[str, ...]
    decided_s: float
    importance: Mapping[str, float]


@dataclass(frozen=True, eq=False)
class Seen:
    """An onset in numbers: all features (k,), and how long after the detection it is [s]."""

    features: Array
    since_s: float


def seen(onset: Onset) -> Seen:
    """Return an onset in numbers, for `decisions_of`.

    Raises:
        LearningError: if it does not tell enough.
    """
    features = measured(onset, tuple(FEATURES))
    if features is None or onset.detected_s is None:
        raise LearningError(
            'nothing can be learned without the fast detector, joint torques and positions: set mode = "fast", and '
            "record q and tau, or tau_ext"
        )
    return Seen(features, float(onset.t[-1]) - onset.detected_s)


def train(
    decisions: Sequence[Decision[Seen]],
    *,
    location: bool = True,
    config: LearnedConfig | None = None,
    provenance: Mapping[str, Any] | None = None,
) -> Training:
    """Train a classifier and cross-validate it by operator, or by recording where there are not two of them.

    Where `config` names no threshold, the model gets the one of 0.5 to 0.9 with the least sum of the shares of helpers
    who were not told and of collisions that were called cooperation, when they were found or later. It is chosen on
    the contacts that were held out, which the figures are of, too.

    Args:
        decisions: with all `FEATURES` of each onset, see `decisions_of` and `seen`.
        location: whether it may look at features that say where on the arm the contact is.
        config: how it decides, in the cross-validation.
        provenance: what is stored with the model.

    Raises:
        LearningError: if there are fewer than ten contacts of a kind.
        TactfulError: if scikit-learn is not installed.
    """
    first = first_of_each(decisions)
    counts = {kind: sum(decision.truth == kind for decision in first) for kind in ("collision", "cooperation")}
    for kind, count in counts.items():
        if count < _LEAST:
            raise LearningError(f"{count} contacts are {kind}: at least {_LEAST} of each kind are needed to learn from")
    columns = [k for k, feature in enumerate(FEATURES.values()) if location or not feature.location]
    there = np.any([np.isfinite(s.features[columns]) for d in decisions for s in d.asks], axis=0)
    columns = [column for column, known in zip(columns, there, strict=True) if known]
    names = [list(FEATURES)[column] for column in columns]
    groups, held_out = _groups(decisions)
    rows, owner = _rows(decisions, columns, groups)
    log_odds = np.zeros(len(rows.x))
    for out in rows.folds():
        if not (others := rows[~out]).both:
            raise LearningError(f"only one {held_out} has both kinds of contact: more are needed to cross-validate")
        log_odds[out] = fit(others).log_odds(rows[out])
    curves = fit(rows)
    config = config or LearnedConfig()
    candidates = _THRESHOLDS if config.threshold is None else (config.threshold,)
    held = [log_odds[owner == number] for number in range(len(decisions))]
    tried = [_HeldOut.of(held, decisions, first, config.model_copy(update={"threshold": t})) for t in candidates]
    best = min(range(len(tried)), key=lambda number: tried[number].loss)
    told, right, figures = tried[best].told, tried[best].right, tried[best].figures
    operators = sorted({d.operator for d in decisions if d.operator is not None})
    per_operator = {name: _share([right[id(d)] for d in first if d.operator == name]) for name in operators}
    about = {
        "made_by": f"tactful {__version__} train",
        "made_on": datetime.now(UTC).date().isoformat(),
        "collisions": counts["collision"],
        "cooperations": counts["cooperation"],
        "decisions": len(decisions),
        "operators": operators,
        "strength": curves.strength,
        **(provenance or {}),
    }
    stored = {name: share.to_dict() for name, share in figures.items()}
    return Training(
        model=_model(curves, names, candidates[best], about, stored | {"held_out": held_out}),
        held_out=held_out,
        collisions=counts["collision"],
        cooperations=counts["cooperation"],
        per_operator=per_operator,
        told=tuple(kind for kind, _ in told),
        decided_s=float(np.mean([since_s for _, since_s in told])),
        importance=_importance(curves, rows, names),
        **figures,
    )


@dataclass(frozen=True)
class _HeldOut:
    """What a threshold makes of the decisions that were held out."""

    told: list[tuple[str, float]]
    right: Mapping[int, bool]
    figures: Mapping[str, Share]

    @property
    def loss(self) -> float:
        return self.figures["spurious"].value - self.figures["sensitivity"].value

    @classmethod
    def of(
        cls,
        log_odds: Sequence[Array],
        decisions: Sequence[Decision[Seen]],
        first: Sequence[Decision[Seen]],
        config: LearnedConfig,
    ) -> _HeldOut:
        told = [_told(values, decision, config) for values, decision in zip(log_odds, decisions, strict=True)]
        right = {id(d): kind == d.truth for d, (kind, _) in zip(decisions, told, strict=True)}
        spurious: dict[tuple[str, int], bool] = {}
        for decision, (kind, _) in zip(decisions, told, strict=True):
            if decision.truth == "collision":
                spurious[decision.contact] = spurious.get(decision.contact, False) or kind == "cooperation"
        return cls(
            told,
            right,
            {
                "accuracy": _share([right[id(d)] for d in first]),
                "specificity": _share([right[id(d)] for d in first if d.truth == "collision"]),
                "sensitivity": _share([right[id(d)] for d in first if d.truth == "cooperation"]),
                "spurious": _share(list(spurious.values())),
            },
        )


def _groups(decisions: Sequence[Decision[Seen]]) -> tuple[Groups, str]:
    """Return what is held out together, and what that is.

    Recordings without an operator, such as those of collisions only, are spread over the operators.
    """
    operators = sorted({d.operator for d in decisions if d.operator is not None})
    sources = [d.contact[0] for d in decisions]
    if len(operators) < 2:
        return np.array(sources), "recording"
    nobody = sorted({d.contact[0] for d in decisions if d.operator is None})
    turn = {source: operators[number % len(operators)] for number, source in enumerate(nobody)}
    return np.array([d.operator or turn[d.contact[0]] for d in decisions]), "operator"


def _model(
    curves: Curves, names: list[str], threshold: float, about: dict[str, Any], figures: dict[str, Any]
) -> AdditiveModel:
    return AdditiveModel(
        features=tuple(names),
        knots=curves.knots,
        values=curves.values,
        offset=curves.offset,
        threshold=threshold,
        provenance=about,
        figures=figures,
    )


def _rows(decisions: Sequence[Decision[Seen]], columns: list[int], groups: Groups) -> tuple[Rows, NDArray[np.int64]]:
    """Return one row an onset, and the number of the decision that it belongs to."""
    owner = np.array([number for number, decision in enumerate(decisions) for _ in decision.asks])
    rows = Rows(
        x=np.array([seen.features[columns] for decision in decisions for seen in decision.asks]),
        cooperation=np.array([decision.truth == "cooperation" for decision in decisions])[owner],
        context=np.array([int(decision.after_collision) for decision in decisions])[owner],
        weight=np.array([1 / len(decision.asks) for decision in decisions])[owner],
        group=groups[owner],
    )
    return rows, owner


def _importance(curves: Curves, rows: Rows, names: list[str]) -> dict[str, float]:
    mean = np.average(np.abs(curves.parts(rows)), axis=0, weights=rows.weight)
    return {names[k]: float(mean[k]) for k in np.argsort(-mean)}


def _told(log_odds: Array, decision: Decision[Seen], config: LearnedConfig) -> tuple[str, float]:
    """Return what a classifier would tell, and when."""
    for number, (seen, value) in enumerate(zip(decision.asks, log_odds, strict=True)):
        kind = config.kind(float(1 / (1 + np.exp(-value))), last=number + 1 == len(decision.asks))
        if kind is not None:
            return kind, seen.since_s
    raise AssertionError("the last ask decides")


def _share(answers: Sequence[bool]) -> Share:
    return Share(sum(answers), len(answers))
