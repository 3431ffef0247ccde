"""What touches the arm while something else touches it."""

from dataclasses import replace

import pytest

from tactful import Label, Monitor, MonitorConfig, Robot
from tactful.classification import Evidence, Onset, Verdict
from tactful.learning import decisions_of, seen
from tests.monitor._touched import Touch, recording

QUIET = MonitorConfig(noise={"velocity_rad_s": 0.0005, "torque_nm": 0.05, "model_nm": 0.1})


@pytest.fixture(scope="module")
def panda() -> Robot:
    """The arm of all recordings here."""
    return Robot.load("panda")


class Script:
    """A classifier that tells what it is told to, in turn, and notes when it was asked."""

    def __init__(self, *kinds: str, confidence: float = 0.99) -> None:
        self.kinds, self.confidence, self.asked = list(kinds), confidence, list[float]()

    def classify(self, onset: Onset) -> Verdict:
        """Return the next kind."""
        assert onset.detected_s is not None
        self.asked.append(onset.detected_s)
        kind = self.kinds.pop(0) if len(self.kinds) > 1 else self.kinds[0]
        return Verdict(kind, self.confidence, (Evidence("script", None, None, kind),))  # type: ignore[arg-type]


def test_help_is_found_while_the_collision_still_changes(panda: Robot) -> None:
    """An obstacle that the arm slides along never lets the level rest; what rises beyond that is asked about."""
    hit = Touch(1.5, 9.0, (0.0, -15.0, 0.0))
    slides = [Touch(1.7 + 0.1 * k, 1.8 + 0.1 * k, (5.0 * (-1) ** k, 0.0, 0.0), rise_s=0.05) for k in range(20)]
    help_ = Touch(2.8, 3.4, (0.0, 0.0, 25.0), rise_s=0.1)
    classifier = Script("collision")
    Monitor(panda, QUIET, classifier=classifier).run(recording(panda, hit, *slides, noise_nm=0.02))
    without = len([t for t in classifier.asked if t > 2.8])
    classifier = Script("collision")
    Monitor(panda, QUIET, classifier=classifier).run(recording(panda, hit, *slides, help_, noise_nm=0.02))
    assert min((t for t in classifier.asked if t > 2.8), default=9.0) < 2.95
    assert len([t for t in classifier.asked if t > 2.8]) > without


def test_a_collision_in_a_cooperation_takes_its_place(panda: Robot) -> None:
    """The arm that a hand leads runs into something: that is a collision, told within milliseconds."""
    hand = Touch(1.2, 3.0, (12.0, 0.0, 0.0), rise_s=0.3)
    hit = Touch(2.2, 2.7, (0.0, -30.0, 0.0), rise_s=0.01)
    samples = recording(panda, hand, hit, noise_nm=0.02)
    timeline = Monitor(panda, QUIET, classifier=Script("cooperation", "collision")).run(samples)
    first, second = timeline
    assert (first.kind, second.kind) == ("cooperation", "collision")
    assert first.end_s == pytest.approx(second.onset_s)
    assert 0 <= second.detected_s - 2.2 < 0.02


def test_a_cooperation_goes_on_where_the_collision_is_not_sure(panda: Robot) -> None:
    """A hand that jerks is no obstacle: what is not sure changes nothing and tells nothing."""
    hand = Touch(1.2, 3.0, (12.0, 0.0, 0.0), rise_s=0.3)
    jerk = Touch(2.2, 2.7, (0.0, -30.0, 0.0), rise_s=0.01)
    samples = recording(panda, hand, jerk, noise_nm=0.02)
    told = Script("cooperation", "collision", confidence=0.8)
    (event,) = Monitor(panda, QUIET, classifier=told).run(samples)
    assert event.kind == "cooperation"
    assert len(told.asked) > 1


def test_a_hand_alone_asks_once(panda: Robot) -> None:
    """What people do within a push is slow: it is no new contact."""
    told = Script("cooperation")
    Monitor(panda, QUIET, classifier=told).run(
        recording(panda, Touch(1.2, 2.5, (12.0, 0.0, 0.0), rise_s=0.3), noise_nm=0.02)
    )
    assert len(set(told.asked)) == 1


def test_what_nobody_knows_is_not_learned(panda: Robot) -> None:
    """A hand leads an arm that lies on an obstacle: the labels do not say which of the two changed."""
    hit, hand = Touch(1.2, 9.0, (0.0, -15.0, 0.0)), Touch(2.0, 3.6, (15.0, 0.0, 0.0), rise_s=0.1)
    again = Touch(2.8, 3.3, (0.0, 0.0, 40.0), rise_s=0.01)
    labels = (Label("collision", 1.2, 3.99), Label("cooperation", 2.0, 3.6))
    samples = replace(recording(panda, hit, hand, again, noise_nm=0.02), labels=labels)
    found = decisions_of(samples, panda, QUIET, seen)
    assert [decision.contact[1] for decision in found] == [0, 1]
