"""What there is to decide in a recording."""

from dataclasses import replace

import numpy as np
import pytest

from tactful import Label, MonitorConfig, Recording, Robot
from tactful.classification import KinestheticClassifier, KinestheticConfig
from tactful.evaluation import EvaluationError
from tactful.learning import Candidates, decisions_of, operator_of, seen, tune
from tests.monitor._touched import Touch, recording

QUIET = MonitorConfig(noise={"velocity_rad_s": 0.0005, "torque_nm": 0.05, "model_nm": 0.1})


@pytest.fixture(scope="module")
def panda() -> Robot:
    """The arm of all recordings here."""
    return Robot.load("panda")


@pytest.fixture(scope="module")
def touched(panda: Robot) -> Recording:
    """A collision at 1.5 s, help at 2.7 s while it is there, of an operator."""
    hit, help_ = Touch(1.5, 9.0, (0.0, -15.0, 0.0)), Touch(2.7, 3.2, (12.0, 0.0, 0.0), rise_s=0.1)
    made = recording(panda, hit, help_, noise_nm=0.02)
    labels = (Label("collision", 1.5, 3.99), Label("cooperation", 2.7, 3.2))
    return replace(made, labels=labels, notes=("operator: calm",))


def test_each_detection_is_a_decision_with_its_truth(panda: Robot, touched: Recording) -> None:
    """First the collision in free motion, then the help beside it; each asked more than once, as time goes on."""
    found = decisions_of(touched, panda, QUIET, seen)
    assert [(d.truth, d.after_collision, d.contact) for d in found] == [
        ("collision", False, ("touched.csv", 0)),
        ("cooperation", True, ("touched.csv", 1)),
    ]
    assert {d.operator for d in found} == {"calm"}
    for decision in found:
        assert [round(ask.since_s, 3) for ask in decision.asks] == [0.02, 0.04, 0.06]
        assert np.isfinite(decision.asks[-1].features).sum() > 8


def test_what_belongs_to_no_label_is_left_out(panda: Robot, touched: Recording) -> None:
    """A false alarm teaches nothing, nor does a label that does not say what the contact is."""
    assert decisions_of(replace(touched, labels=()), panda, QUIET, seen) == ()
    other = tuple(replace(label, kind="contact") for label in touched.labels)
    assert decisions_of(replace(touched, labels=other), panda, QUIET, seen) == ()


def test_labels_have_to_fit(panda: Robot, touched: Recording) -> None:
    """A label outside of the recording is a mistake that would train the wrong thing."""
    with pytest.raises(EvaluationError, match="lies outside the recording"):
        decisions_of(replace(touched, labels=(Label("collision", 50, 51),)), panda, QUIET, seen)


@pytest.mark.parametrize(
    ("note", "name"),
    [
        ("operator: calm", "calm"),
        ('episode {"kind":"collision","operator":"brisk","place":"peg"}', "brisk"),
        ('episode {"operator":null}', None),
        ("Operator = P-07, second day", "P-07"),
        ("time in ms, converted to s", None),
    ],
)
def test_the_operator_is_read_from_the_notes(note: str, name: str | None) -> None:
    """By hand, or as JSON that a simulation left there."""
    assert operator_of(Recording(t=np.arange(3.0), channels={"q": np.zeros((3, 7))}, notes=(note,))) == name


def test_the_rules_are_tuned_from_recordings(panda: Robot, touched: Recording) -> None:
    """From a recording to a table: with one collision nothing is certified, and how many more it takes is said."""
    candidates = Candidates.of(KinestheticClassifier(KinestheticConfig(rule="angle")))
    found = decisions_of(touched, panda, QUIET, candidates.ask, wait_s=0.2)
    tuning = tune(found, candidates, limit=0.05, confidence=0.95)
    assert tuning.chosen is None
    assert [(share.count, share.total) for share in tuning.misclassified[:10]] == [(0, 1)] * 10
    assert "58 more collisions are needed" in tuning.shortfall
