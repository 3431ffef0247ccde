"""The choice of a threshold."""

from pathlib import Path

import numpy as np
import pytest

from tactful import MonitorConfig
from tactful.classification import KinestheticClassifier, KinestheticConfig, LearnedClassifier, LearnedConfig
from tactful.learning import Candidates, Decision, LearningError, tune
from tests.classification.test_learned import model

LEARNED = Candidates.of(LearnedClassifier(model()))


def scored(truth: str, scores: list[tuple[float, ...]], start: int = 0) -> list[Decision[tuple[str, ...]]]:
    """Return decisions whose asks have these probabilities of cooperation."""
    asks = []
    for row in scores:
        last = len(row) - 1
        asks.append(
            tuple(
                tuple(LearnedConfig(threshold=t).kind(p, last=k == last) or "contact" for t in LEARNED.values)
                for k, p in enumerate(row)
            )
        )
    return [
        Decision(truth=truth, contact=("r", start + k), operator=None, after_collision=False, asks=ask)  # type: ignore[arg-type]
        for k, ask in enumerate(asks)
    ]


def test_of_what_keeps_the_bound_the_best_is_chosen() -> None:
    """100 collisions below 0.3 and 50 cooperations above 0.4: anything between is right, and certified."""
    low = scored("collision", [(p,) for p in np.linspace(0.01, 0.29, 100)])
    high = scored("cooperation", [(p,) for p in np.linspace(0.41, 0.99, 50)], start=100)
    tuning = tune(low + high, LEARNED, limit=0.05, confidence=0.95)
    assert tuning.value is not None
    assert 0.29 <= tuning.value <= 0.41
    assert tuning.chosen is not None
    assert tuning.misclassified[tuning.chosen].count == 0
    assert tuning.sensitivity[tuning.chosen].value == 1
    assert tuning.certified > tuning.chosen
    assert tuning.shortfall == ""


def test_a_collision_counts_once_however_often_it_is_called_cooperation() -> None:
    """And it counts as misclassified if any of its detections was."""
    twice = scored("collision", [(0.1,), (0.9,), (0.9,)])
    same = [Decision(**(vars_of(d) | {"contact": ("r", 0)})) for d in twice]
    tuning = tune(same + scored("cooperation", [(0.99,)], start=9), LEARNED, limit=0.05, confidence=0.95)
    half = LEARNED.values.index(0.5)
    assert (tuning.misclassified[half].count, tuning.misclassified[half].total) == (1, 1)


def vars_of(decision: Decision[tuple[str, ...]]) -> dict[str, object]:
    """Return the fields of a decision."""
    return {name: getattr(decision, name) for name in Decision.__dataclass_fields__}


def test_a_classifier_that_waits_is_replayed_as_it_would_decide() -> None:
    """First 0.6, which is not sure, then 0.97: cooperation at any threshold up to that."""
    tuning = tune(
        scored("collision", [(0.02,)]) + scored("cooperation", [(0.6, 0.97)], start=5),
        LEARNED,
        limit=0.5,
        confidence=0.5,
    )
    told = {value: share.count for value, share in zip(LEARNED.values, tuning.sensitivity, strict=True)}
    assert told[0.95] == told[0.5] == 1
    assert told[0.98] == 0


def test_where_nothing_keeps_the_bound_it_says_what_it_would_take() -> None:
    """More events where the share is small enough, another classifier where it is not."""
    few = scored("collision", [(0.1,)] * 20)
    help_ = scored("cooperation", [(0.9,)] * 5, start=100)
    tuning = tune(few + help_, LEARNED, limit=0.05, confidence=0.95)
    assert (tuning.chosen, tuning.value) == (None, None)
    assert "39 more collisions are needed" in tuning.shortfall
    bad = scored("collision", [(0.9999,)] * 20)
    assert "another classifier would" in tune(bad + help_, LEARNED, limit=0.05, confidence=0.95).shortfall


def test_the_settings_that_come_of_it(tmp_path: Path) -> None:
    """The value in its section, where the model is seen from the folder of the file, and where it comes from."""
    low = scored("collision", [(0.1,)] * 100)
    high = scored("cooperation", [(0.9,)] * 10, start=200)
    tuning = tune(low + high, LEARNED, limit=0.05, confidence=0.95)
    (tmp_path / "models").mkdir()
    model().save(tmp_path / "models" / "a.npz")
    config = MonitorConfig(classifier=str(tmp_path / "models" / "a.npz"))
    tuning.applied_to(config, folder=tmp_path).save(tmp_path / "monitor.toml")
    again = MonitorConfig.load(tmp_path / "monitor.toml")
    assert again.learned.threshold == tuning.value
    assert again.provenance["tuning"]["misclassified_collisions"] == "0 of 100"
    assert isinstance(again.load_classifier(), LearnedClassifier)
    assert 'classifier = "models/a.npz"' in (tmp_path / "monitor.toml").read_text()


@pytest.mark.parametrize(("rule", "key"), [("floored", "gamma"), ("literal", "gamma"), ("angle", "gamma_deg")])
def test_what_is_tuned_of_the_rules(rule: str, key: str) -> None:
    """From the value that calls the most a collision downwards, in an order that no data decide."""
    candidates = Candidates.of(KinestheticClassifier(KinestheticConfig(rule=rule)))  # type: ignore[arg-type]
    assert (candidates.section, candidates.key) == ("kinesthetic", key)
    assert list(candidates.values) == sorted(candidates.values, reverse=True)
    for value, classifier in zip(candidates.values, candidates.classifiers, strict=True):
        assert isinstance(classifier, KinestheticClassifier)
        assert getattr(classifier.config, key) == value


@pytest.mark.parametrize(("limit", "confidence"), [(0.0, 0.95), (1.0, 0.95), (0.05, 1.0)])
def test_shares_are_shares(limit: float, confidence: float) -> None:
    """A bound of 5 instead of 0.05 is a common slip."""
    with pytest.raises(LearningError, match="it has to lie between 0 and 1"):
        tune(scored("collision", [(0.1,)]), LEARNED, limit=limit, confidence=confidence)
