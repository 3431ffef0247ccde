"""Collision or cooperation by a model that was learned from labelled contacts."""

from __future__ import annotations

from functools import cache
from importlib import resources
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from tactful.classification._additive import AdditiveModel
from tactful.classification._features import FEATURES, measured
from tactful.classification._kinesthetic import KinestheticClassifier
from tactful.classification._onset import Onset
from tactful.classification._verdict import Classifier, Evidence, Verdict
from tactful.config import Config

_TOLD = 4
"""How many features an event lists, at most."""
_LEAST = 0.1
"""Least contribution to the log odds that is worth a line."""


@cache
def built_in() -> AdditiveModel:
    """Return the model that is part of Tactful, trained on simulated contacts of many kinds, see its `provenance`."""
    with resources.as_file(resources.files("tactful.classification") / "contacts.npz") as file:
        return AdditiveModel.load(file)


class LearnedConfig(Config):
    """How a learned classifier decides, see `LearnedClassifier`."""

    threshold: Annotated[float, Field(gt=0, lt=1)] | None = None
    """Probability of cooperation above which a contact is one; None takes the one that was chosen with the model, see
    `learning.train`. `tactful tune` sets it for a stated guarantee."""
    sure: Annotated[float, Field(ge=0.5, lt=1)] = 0.95
    """Probability from which a contact is told at once; below it, it stays `contact` and is looked at again."""
    wait_s: Annotated[float, Field(ge=0, le=0.2)] = 0.07
    """How long after the detection it is told at the latest: 50 ms after it is first asked [s]."""

    def kind(self, p: float, *, last: bool) -> Literal["collision", "cooperation"] | None:
        """Return what a probability of cooperation means; None as long as it may wait and neither is sure."""
        threshold = 0.5 if self.threshold is None else self.threshold
        if not last and max(p, 1 - p) < self.sure:
            return None
        if not last and (p > 0.5) != (p > threshold):
            return None
        return "cooperation" if p > threshold else "collision"


class LearnedClassifier:
    """Tell a collision from a person who helps by the probability that an `AdditiveModel` gives.

    While the probability of neither is `sure`, the contact stays a `contact`; the monitor asks again every
    `FastConfig.decide_s`, up to `wait_s` after the detection, when the threshold decides. The confidence is the
    calibrated probability of the kind that is told. The evidence is the probability, and the features that added most
    to its log odds: each with its value, and by how much it spoke for which kind.

    It needs the fast detector, joint torques and joint positions; without them the rules tell what a contact is.

    Args:
        model: the model, or the path of its file; None takes `built_in`.
        config: how it decides.
        otherwise: what tells a contact of which not enough is known; by default a `KinestheticClassifier`.

    Raises:
        ModelError: if the file is no model.
    """

    def __init__(
        self,
        model: AdditiveModel | str | Path | None = None,
        config: LearnedConfig | None = None,
        *,
        otherwise: Classifier | None = None,
    ) -> None:
        if model is None:
            model = built_in()
        self.model = model if isinstance(model, AdditiveModel) else AdditiveModel.load(model)
        self.config = config or LearnedConfig()
        if self.config.threshold is None:
            self.config = self.config.model_copy(update={"threshold": self.model.threshold})
        self.otherwise = otherwise or KinestheticClassifier()

    def classify(self, onset: Onset) -> Verdict:
        """Return collision or cooperation, or contact as long as the evidence does not suffice."""
        values = measured(onset, self.model.features)
        if values is None:
            return self.otherwise.classify(onset)
        p = self.model.probability(values, int(onset.after_collision))
        kind = self.config.kind(p, last=not self._asked_again(onset))
        if kind is None:
            text = f"undecided: probability of cooperation {p:.3f}, told at once if sure by {self.config.sure:g}"
            return Verdict("contact", max(p, 1 - p), (Evidence("probability", p, self.config.sure, text),))
        return Verdict(kind, p if kind == "cooperation" else 1 - p, self._evidence(values, onset, p, kind))

    def _asked_again(self, onset: Onset) -> bool:
        if onset.next_s is None or onset.detected_s is None:
            return False
        return onset.next_s - onset.detected_s <= self.config.wait_s + 0.5 / onset.rate_hz

    def _evidence(
        self, values: NDArray[np.float64], onset: Onset, p: float, kind: Literal["collision", "cooperation"]
    ) -> tuple[Evidence, ...]:
        parts = self.model.contributions(values, int(onset.after_collision))
        sign = ">" if kind == "cooperation" else "<="
        text = f"{kind}: probability of cooperation {p:.3f} {sign} {self.config.threshold:g}"
        told = [Evidence("probability", p, self.config.threshold, text)]
        for k in np.argsort(-np.abs(parts))[:_TOLD]:
            if abs(parts[k]) < _LEAST:
                break
            name, part = self.model.features[k], float(parts[k])
            for_kind = "cooperation" if part > 0 else "collision"
            words = f"{FEATURES[name].text(float(values[k]))}: {abs(part):.1f} for {for_kind}"
            told.append(Evidence(name, float(values[k]), None, words))
        return tuple(told)
