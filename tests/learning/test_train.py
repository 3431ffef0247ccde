"""Training on features whose distribution is known."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.special import ndtr

from tactful.classification import AdditiveModel, LearnedConfig
from tactful.learning import LearningError, train
from tests.learning._made import NAMES, decisions

PATIENT = LearnedConfig(sure=0.99)


def test_it_comes_close_to_the_best_that_is_possible() -> None:
    """Two Gaussian classes: the best accuracy is known, and a held-out estimate of it must agree."""
    made = decisions(600)
    training = train(made, config=PATIENT)
    best = ndtr(np.hypot(1.5, 0.75))
    assert training.accuracy.value == pytest.approx(best, abs=0.03)
    assert training.accuracy.total == 600
    assert training.held_out == "operator"
    assert list(training.per_operator) == ["a", "b", "c"]
    assert [name for name in list(training.importance)[:2]] == ["power", "abrupt"]
    fresh = decisions(2000, seed=1)
    last = np.array([decision.asks[-1].features for decision in fresh])
    columns = [NAMES.index(name) for name in training.model.features]
    p = np.array([training.model.probability(x[columns], 0) for x in last])
    helped = np.array([decision.truth == "cooperation" for decision in fresh])
    assert np.mean((p > 0.5) == helped) == pytest.approx(best, abs=0.02)


def test_its_probabilities_are_right() -> None:
    """Calibration on new data: of those told with 70-90 %, that share is right."""
    model = train(decisions(600, apart=0.7), config=PATIENT).model
    columns = [NAMES.index(name) for name in model.features]
    fresh = [(d.truth == "cooperation", s.features) for d in decisions(3000, seed=2, apart=0.7) for s in d.asks]
    p = np.array([model.probability(x[columns], 0) for _, x in fresh])
    helped = np.array([truth for truth, _ in fresh])
    for low, high in ((0.05, 0.3), (0.3, 0.5), (0.5, 0.7), (0.7, 0.95)):
        there = (p > low) & (p <= high)
        assert there.sum() > 200
        assert np.mean(helped[there]) == pytest.approx(np.mean(p[there]), abs=0.06)


def test_what_was_held_out_is_not_seen() -> None:
    """Labels that are noise leave an accuracy of a half: nothing leaks from training into its figures."""
    rng = np.random.default_rng(3)
    made = [replace(d, truth=str(rng.choice(["collision", "cooperation"]))) for d in decisions(300)]
    assert train(made, config=PATIENT).accuracy.value == pytest.approx(0.5, abs=0.1)


def test_without_location_and_what_is_never_known() -> None:
    """A model for arms whose links are not told apart; features that no recording has are left out, too."""
    training = train(decisions(60), location=False)
    assert not training.model.with_location
    assert "lever" not in training.model.features
    assert "from_tip" not in train(decisions(60)).model.features
    assert train(decisions(60)).model.with_location


def test_a_second_context_with_few_contacts_follows_the_first() -> None:
    """Twelve contacts in a collision cannot carry a model of their own; they share the curves."""
    made = [replace(d, after_collision=True) if number < 12 else d for number, d in enumerate(decisions(300))]
    model = train(made, config=PATIENT).model
    power = model.features.index("power")
    first, second = model.values[:, power, -1] - model.values[:, power, 0]
    assert second == pytest.approx(first, rel=0.5)


def test_without_operators_recordings_are_held_out() -> None:
    """Recordings that nobody touched are spread over the operators; without any, each recording is its own group."""
    assert train(decisions(60, operators=(None,))).held_out == "recording"
    mixed = train(decisions(120, operators=("a", None, "b")))
    assert mixed.held_out == "operator"
    assert list(mixed.per_operator) == ["a", "b"]


def test_the_same_data_give_the_same_file(tmp_path: Path) -> None:
    """What is written is what was measured, and reads back."""
    trainings = [train(decisions(60), provenance={"robot": "panda"}) for _ in range(2)]
    np.testing.assert_array_equal(trainings[0].model.values, trainings[1].model.values)
    trainings[0].model.save(tmp_path / "model.npz")
    again = AdditiveModel.load(tmp_path / "model.npz")
    assert again.provenance["robot"] == "panda"
    assert again.provenance["collisions"] == 30
    assert again.figures["accuracy"] == json.loads(json.dumps(trainings[0].accuracy.to_dict()))


def test_too_little_to_learn_from() -> None:
    """A handful of contacts, one kind, or one operator who did all of a kind: one line that says so."""
    with pytest.raises(LearningError, match="9 contacts are collision: at least 10 of each kind"):
        train(decisions(18))
    with pytest.raises(LearningError, match="have no cooperation that the monitor detected"):
        train([d for d in decisions(60) if d.truth == "collision"])
    split = [replace(d, operator="a" if d.truth == "collision" else "b") for d in decisions(60)]
    with pytest.raises(LearningError, match="only one operator has both kinds of contact"):
        train(split)
