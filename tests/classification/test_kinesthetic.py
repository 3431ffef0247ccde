"""Algorithm 2 of the kinesthetic paper and its variants."""

from typing import Any, Literal

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from tactful.classification import KinestheticClassifier, KinestheticConfig, Onset, Verdict
from tactful.config import ConfigError

Rule = Literal["floored", "literal", "angle"]
ALL = (True, True, True)


def onset(
    force_change: Any, velocity: Any, directions: tuple[bool, bool, bool] = ALL, after: Any = None, rise: int = 30
) -> Onset:
    """Return a contact whose force changes linearly by `force_change` over the 30 ms to its detection."""
    before = 300
    share = np.concatenate([np.zeros(before), np.linspace(0, 1, rise + 1)])[:, None]
    motion = None
    if velocity is not None:
        motion = np.tile(np.asarray(velocity, dtype=np.float64), (len(share), 1))
        if after is not None:
            motion[before:] = after
    return Onset(
        rate_hz=1000.0,
        t=np.arange(len(share)) / 1000,
        force_n=share * np.asarray(force_change, dtype=np.float64),
        moment_nm=np.zeros((len(share), 3)),
        velocity_m_s=motion,
        tau_ext_nm=None,
        index=before,
        directions=np.array(directions),
        in_collision=False,
    )


def classify(rule: Rule, force_change: Any, velocity: Any, **more: Any) -> Verdict:
    """Classify with the paper's gamma for the literal rule and the defaults for the others."""
    return KinestheticClassifier(KinestheticConfig(rule=rule)).classify(onset(force_change, velocity, **more))


@pytest.mark.parametrize("rule", ["floored", "literal", "angle"])
def test_a_force_against_the_motion_is_a_collision(rule: Rule) -> None:
    """A1 and A2 agree on the plainest case; all components of the motion are there, so no rule is singular."""
    assert classify(rule, [-5, -3, -4], [0.10, 0.06, 0.08]).kind == "collision"


@pytest.mark.parametrize("rule", ["floored", "literal", "angle"])
def test_a_force_with_the_motion_is_cooperation(rule: Rule) -> None:
    """A1: a static obstacle cannot push the arm where it goes."""
    verdict = classify(rule, [5, 3, 4], [0.10, 0.06, 0.08])
    assert verdict.kind == "cooperation"
    assert verdict.confidence > 0.6


@pytest.mark.parametrize("rule", ["floored", "literal", "angle"])
def test_a_force_across_the_motion_is_cooperation(rule: Rule) -> None:
    """A2: the force of a collision is where the motion is; this one is not."""
    assert classify(rule, [0, -8, 0.1], [0.15, 0.002, -0.002], directions=(False, True, False)).kind == "cooperation"


def test_the_value_of_a2_is_the_norm_of_the_ratio_of_unit_vectors() -> None:
    """(6) term by term; for parallel vectors it is sqrt(3), whatever their length."""
    force, velocity = np.array([-2.0, -1.0, -2.0]), np.array([0.1, 0.2, 0.2])
    u_F, u_v = force / np.linalg.norm(force), velocity / np.linalg.norm(velocity)
    evidence = classify("literal", force, velocity).evidence[0]
    assert evidence.value == pytest.approx(np.sqrt(sum((f / v) ** 2 for f, v in zip(u_F, u_v, strict=True))))
    assert (evidence.rule, evidence.threshold) == ("A2", 6.2)
    assert classify("literal", -3 * velocity, velocity).evidence[0].value == pytest.approx(np.sqrt(3))


def test_the_literal_rule_is_singular_where_the_floored_one_is_not() -> None:
    """A head-on collision with a trace of force across it is literally cooperation: hence the floor."""
    force, velocity = [-10, 0, -0.3], [0.15, 0.0, 0.00001]
    assert classify("literal", force, velocity).kind == "cooperation"
    assert classify("floored", force, velocity).kind == "collision"
    assert classify("literal", [-10, 0, -0.3], [0.15, 0, 0]).confidence == 1.0


def test_the_floored_rule_takes_no_sign_from_a_component_that_is_noise() -> None:
    """In A1 too, a velocity of 0.01 mm/s along z says nothing."""
    force, velocity = [-10, 0, 0.3], [0.15, 0.0, 0.00001]
    assert classify("literal", force, velocity).evidence[0].rule == "A1"
    assert classify("floored", force, velocity).kind == "collision"


@given(seed=st.integers(0, 10_000))
def test_the_angle_rule_does_not_depend_on_the_axes(seed: int) -> None:
    """Turning the robot's base changes nothing; the rules by components have no such property."""
    rng = np.random.default_rng(seed)
    force, velocity = rng.normal(size=3), 0.1 * rng.normal(size=3)
    turn = Rotation.random(rng=rng).as_matrix()
    plain, turned = classify("angle", force, velocity), classify("angle", turn @ force, turn @ velocity)
    if np.linalg.norm(velocity) > 0.012 and abs(plain.evidence[0].value - 30) > 1e-6:
        assert turned.kind == plain.kind
        assert turned.evidence[0].value == pytest.approx(plain.evidence[0].value, abs=1e-6)


@given(seed=st.integers(0, 10_000))
def test_the_length_of_force_and_velocity_does_not_matter(seed: int) -> None:
    """The rules see unit vectors only, so they need no tuning to speed or force."""
    rng = np.random.default_rng(seed)
    force, velocity = rng.normal(size=3), 0.1 * rng.normal(size=3) + 0.02
    if np.linalg.norm(velocity) > 0.012:
        for rule in ("floored", "literal", "angle"):
            assert classify(rule, force, velocity).kind == classify(rule, 7 * force, 3 * velocity).kind


def test_without_velocity_a_contact_stays_a_contact_and_says_why() -> None:
    """What is missing is not invented."""
    verdict = classify("floored", [5, 0, 0], None)
    assert verdict.kind == "contact"
    assert "needs q and dq" in verdict.evidence[0].text


def test_at_standstill_the_motion_that_follows_decides() -> None:
    """An obstacle cannot set an arm at rest in motion; an arm that does not give way leaves the question open."""
    assert classify("floored", [0, 9, 0], [0, 0, 0], after=[0, 0.05, 0]).kind == "cooperation"
    assert classify("floored", [0, 9, 0], [0, 0, 0]).kind == "contact"
    assert classify("floored", [0, 9, 0], [0, 0, 0], after=[0, -0.05, 0]).kind == "contact"


def test_the_force_change_is_cut_at_the_detection() -> None:
    """A secant of 30 ms when only 10 ms are known takes 10 ms, and never looks ahead."""
    early = onset([-6, 0, 0], [0.1, 0, 0], rise=10)
    np.testing.assert_allclose(early.force_change_n(0.03), [-6, 0, 0])
    np.testing.assert_allclose(early.force_change_n(0.0), [-0.6, 0, 0])


def test_confidence_is_a_half_at_the_threshold_and_grows_away_from_it() -> None:
    """The confidence is a plain function of the margin."""
    angles = np.radians([0, 15, 29.9, 31, 60])
    sure = [classify("angle", [-np.cos(angle), -np.sin(angle), 0], [0.1, 0, 0]) for angle in angles]
    assert [verdict.kind for verdict in sure] == ["collision"] * 3 + ["cooperation"] * 2
    values = [verdict.confidence for verdict in sure]
    assert values[0] == 1.0
    assert values[0] > values[1] > values[2] == pytest.approx(0.5, abs=0.01)
    assert values[3] < values[4]


def test_a_wrong_setting_names_its_section() -> None:
    """A user who mistypes a rule is told which ones there are."""
    with pytest.raises(ConfigError, match=r"kinesthetic\.rule: Input should be 'floored', 'literal' or 'angle'"):
        KinestheticConfig(rule="flored")  # type: ignore[arg-type]
