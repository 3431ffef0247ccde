"""Features of an onset."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tactful.classification import FEATURES, Onset, measured
from tests.classification._onsets import DYNAMICS, PANDA, at_tip, moving, touched

COLLISION = ("along_collision", "beside_collision", "with_force_beside", "since_collision")


def feature(name: str, onset: Onset) -> float:
    """Return one feature."""
    values = measured(onset, [name])
    assert values is not None
    return float(values[0])


def test_a_force_against_the_motion_and_one_with_it() -> None:
    """The first cue of the paper, as a cosine."""
    ahead = moving([0, 0.2, 0])
    assert feature("against_motion", touched(at_tip([0, -10, 0]), ahead)) == pytest.approx(-1, abs=0.01)
    assert feature("against_motion", touched(at_tip([0, 10, 0]), ahead)) == pytest.approx(1, abs=0.01)
    assert feature("against_motion", touched(at_tip([10, 0, 0]), ahead)) == pytest.approx(0, abs=0.01)


def test_power_is_a_cosine_in_the_metric_of_the_inertia() -> None:
    """A torque along -M dq would only slow the arm down: -1. Its sign is that of F v at the contact, whatever link."""
    dq = moving([0.1, 0.2, 0])
    against = -DYNAMICS.mass_matrix(PANDA.home) @ dq
    assert feature("power", touched(30 * against / np.linalg.norm(against), dq)) == pytest.approx(-1, abs=0.01)


@given(seed=st.integers(0, 10_000))
def test_no_static_obstacle_does_positive_work(seed: int) -> None:
    """Wherever it is: a force at any point of any link that opposes the velocity of that point has negative power."""
    rng = np.random.default_rng(seed)
    dq = 0.3 * rng.standard_normal(7)
    link = int(rng.integers(2, 7))
    point = DYNAMICS.pose(PANDA.home, PANDA.tip)[1] + 0.1 * rng.standard_normal(3)
    J = DYNAMICS.jacobian_at(PANDA.home, link, point)[:3]
    force = -15 * (J @ dq) / max(float(np.linalg.norm(J @ dq)), 1e-6)
    assert feature("power", touched(J.T @ force, dq)) < 0


def test_without_motion_its_direction_says_nothing() -> None:
    """At a few mm/s a direction is noise: it fades instead of turning at random."""
    for name in ("against_motion", "power"):
        assert abs(feature(name, touched(at_tip([0, -10, 0]), moving([0, 0.0005, 0])))) < 0.1


def test_the_motion_that_follows() -> None:
    """A person moves the arm; an obstacle stops it."""
    led = touched(at_tip([0, 10, 0]), np.zeros(7), moving([0, 0.1, 0]))
    stopped = touched(at_tip([0, -10, 0]), moving([0, 0.2, 0]), np.zeros(7))
    assert feature("with_force", led) > 1 > 0.1 > abs(feature("with_force", stopped))
    assert feature("power_after", led) > 0.7
    assert feature("turned", stopped) > 1


def test_lever_arm_and_what_no_force_at_the_tip_explains() -> None:
    """Where the contact is, without an isolation: a force at the tip has no lever there and leaves nothing."""
    dq = moving([0, 0.2, 0])
    tip = touched(at_tip([3, -14, 5]), dq)
    assert feature("not_a_force", tip) < 0.02
    assert 10 ** feature("lever", tip) < 0.03
    elbow = DYNAMICS.jacobian_at(PANDA.home, 3, DYNAMICS.pose(PANDA.home, PANDA.tip)[1] - [0.3, 0, -0.3])[:3]
    other = touched(elbow.T @ np.array([0.0, -14, 5]), dq)
    assert feature("not_a_force", other) > 0.3
    assert feature("not_a_wrench", other) < feature("not_a_force", other)
    assert 10 ** feature("lever", other) > 0.1


def test_noise_alone_is_not_unexplained() -> None:
    """The share counts beyond what the noise would leave."""
    rng = np.random.default_rng(0)
    y = at_tip([0, -8, 0])
    shares = [
        feature(
            "not_a_force", touched(y + rng.standard_normal(7), moving([0, 0.2, 0]), torque_covariance_nm2=np.eye(7))
        )
        for _ in range(200)
    ]
    assert np.mean(shares) < 0.12


def test_an_impact_is_there_at_once_and_a_hand_is_not() -> None:
    """The share that came within 20 ms, and the steepest rise: whenever the contact was detected."""
    slow, fast = (touched(at_tip([0, -10, 0]), moving([0, 0.2, 0]), rise_s=rise_s) for rise_s in (0.18, 0.0))
    assert feature("abrupt", slow) == pytest.approx(0.1, abs=0.01)
    assert feature("abrupt", fast) == pytest.approx(1)
    assert 10 ** feature("rate", slow) == pytest.approx(50, rel=0.05)
    assert 10 ** feature("rate", fast) == pytest.approx(500, rel=0.05)


def test_an_obstacle_that_lets_go_is_no_help() -> None:
    """The arm then moves with the change of the force, but only as the collision held it; help acts beside that."""
    held, freed = at_tip([0, -10, 0]), moving([0, 0.1, 0])
    lets_go = touched(-0.8 * held, np.zeros(7), freed, in_collision=True, collision_torque_nm=held, collision_s=0.1)
    assert feature("with_force", lets_go) > 1
    assert feature("with_force_beside", lets_go) == pytest.approx(0, abs=1e-6)
    lifted = moving([0, 0, 0.1])
    helped = touched(
        at_tip([0, 0, 10]), np.zeros(7), lifted, in_collision=True, collision_torque_nm=held, collision_s=0.1
    )
    assert feature("with_force_beside", helped) > 1


def test_beside_a_collision() -> None:
    """In state COLL the change is held against the collision that is there; without one nothing is known."""
    y, dq = at_tip([0, -4, 0]), np.zeros(7)
    alone = touched(y, dq)
    assert np.isnan([feature(name, alone) for name in COLLISION]).all()
    more = touched(y, dq, in_collision=True, collision_torque_nm=2 * y, collision_s=0.1)
    assert feature("along_collision", more) == pytest.approx(1)
    assert 10 ** feature("beside_collision", more) == pytest.approx(0.5)
    assert 10 ** feature("since_collision", more) == pytest.approx(0.2, rel=0.01)


@pytest.mark.parametrize(
    "lack", ["torque_change_nm", "torque_covariance_nm2", "jacobian", "mass_matrix", "q_rad", "tau_ext_nm"]
)
def test_what_is_missing_is_not_invented(lack: str) -> None:
    """Paper mode, a wrench alone, or a log without positions: no features."""
    fields: dict[str, Any] = {lack: None}
    assert measured(touched(at_tip([0, -10, 0]), np.zeros(7), **fields), tuple(FEATURES)) is None


def test_every_feature_has_words() -> None:
    """Each line of evidence is a sentence with a number."""
    onset = touched(at_tip([0, -10, 0]), moving([0, 0.2, 0]))
    values = measured(onset, tuple(FEATURES))
    assert values is not None
    for value, (name, each) in zip(values, FEATURES.items(), strict=True):
        assert "{" not in each.text(float(value)), name
        assert each.words.count("{") == 1
