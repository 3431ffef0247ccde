"""What went wrong with an impact: features by their geometry, the model against scipy, and what it does not know."""

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import stats

from tactful.classification import (
    IMPACT_FEATURES,
    AimAware,
    AimAwareConfig,
    AimAwareResult,
    ImpactCauses,
    ImpactFeatures,
    impact_features,
)
from tactful.dynamics import Dynamics
from tactful.errors import TactfulError
from tactful.impacts import ContactPoint, ImpactPlan
from tactful.robots import Robot

PANDA = Robot.load("panda")
NORMAL = np.array([0.0, 0.0, 1.0])
PLAN = ImpactPlan(
    0.5, PANDA.home, [0.5], np.zeros((1, 7)), contacts=(ContactPoint(6, np.array([0.0, 0.0, 0.2]), NORMAL),)
)
NAMES = list(IMPACT_FEATURES)


def struck(twist: NDArray[np.float64], *, impact_s: float = 0.48) -> AimAwareResult:
    """The verdict on an arm at home whose tool moves from the impact on with a twist [m/s, rad/s]."""
    tip = PLAN.contacts[0]
    R, p = Dynamics(PANDA).pose(PANDA.home)
    frame = PANDA.frames[PANDA.tip]
    R = R @ frame.rotation.T  # of the link
    point = p + R @ (tip.point_m - frame.translation)
    dq = np.linalg.pinv(Dynamics(PANDA).jacobian_at(PANDA.home, 6, point)) @ twist
    t = np.arange(0.3, 0.7, 1e-3)
    after = np.maximum(t - impact_s, 0.0)[:, None]
    r = np.where(t[:, None] >= impact_s - 1e-9, 20.0, 0.0) * np.eye(7)[1]
    aim = AimAware(PLAN, AimAwareConfig())
    aim.run(t, PANDA.home + after * dq, np.where(after > 0, dq, 0.0), r)
    return aim.result


def test_features_are_motions_of_the_tool() -> None:
    """A known motion of the tool against the plan has to come out as its parts, in base axes, whatever the joints."""
    features = impact_features(struck(np.array([0.02, 0.0, -0.05, 0.3, 0.0, 0.2])), PLAN, PANDA)
    value = dict(zip(NAMES, features.values, strict=True))
    assert value["lead"] == pytest.approx(-0.02)
    assert value["impacts"] == 1
    assert value["normal_2"] == pytest.approx(-0.05, abs=1e-6)
    assert value["slide_2"] == pytest.approx(0.02, abs=1e-6)
    assert value["turn_1_2"] == pytest.approx(0.3, abs=1e-6)
    assert value["turn_2_2"] == pytest.approx(0.0, abs=1e-6)
    np.testing.assert_allclose(features.tilt_deg, [np.degrees(0.3 * 0.101), 0.0, 0.0], atol=1e-6)
    assert features.inclination_deg == pytest.approx(np.degrees(0.03), rel=0.02)
    assert value["end_normal"] == pytest.approx(-0.05 * 0.101, rel=1e-6)
    assert value["strength"] == pytest.approx(np.log1p(20e3))


def test_the_inclination_has_a_sign() -> None:
    """A surface that is inclined the other way is another error of the set-up."""
    one, other = (impact_features(struck(np.array([0, 0, 0, 0, w, 0])), PLAN, PANDA) for w in (0.5, -0.5))
    assert one.inclination_deg == pytest.approx(-other.inclination_deg)
    assert one.inclination_deg > 2


def made(count: int, seed: int = 0) -> tuple[list[ImpactFeatures], list[str]]:
    """Features of two causes, each with a covariance of its own, in the first three features."""
    rng = np.random.default_rng(seed)
    values, causes = [], []
    for cause, mean, factor in (
        ("as planned", 0.0, np.eye(3)),
        ("bent", 3.0, np.array([[2, 0, 0], [1, 1, 0], [0, 0, 3.0]])),
    ):
        for x in mean + rng.standard_normal((count, 3)) @ factor.T:
            values.append(np.concatenate([x, np.zeros(len(NAMES) - 3)]))
            causes.append(cause)
    return [ImpactFeatures(x, np.zeros(3)) for x in values], causes


def test_probabilities_are_those_of_normal_distributions() -> None:
    """Without shrinkage the model is Bayes' rule on scipy's densities of the samples' mean and covariance."""
    runs, causes = made(400)
    model = ImpactCauses.learn(runs, causes, shrinkage=0.0, floor=1e-4)
    X = np.array([run.values[:3] for run in runs])
    labels = np.array(causes)
    normals = [
        stats.multivariate_normal(X[labels == cause].mean(axis=0), np.cov(X[labels == cause].T))
        for cause in model.causes
    ]
    for run in runs[::40]:
        density = np.array([normal.pdf(run.values[:3]) for normal in normals])
        told = model.tell_features(run)
        expected = dict(zip(model.causes, density / density.sum(), strict=True))
        assert told.probabilities == pytest.approx(expected, abs=2e-3)


def test_says_why_and_how_sure() -> None:
    """The evidence names the features that differ from an impact as planned."""
    runs, causes = made(50)
    model = ImpactCauses.learn(runs, causes)
    held_out, truth = made(100, seed=1)
    told = [model.tell_features(run) for run in held_out]
    right = [what.cause == cause for what, cause in zip(told, truth, strict=True)]
    assert np.mean(right) > 0.85
    assert abs(np.mean([what.confidence for what in told]) - np.mean(right)) < 0.1
    bent = model.tell_features(held_out[-1])
    assert bent.evidence[0].rule in NAMES[:3]
    assert bent.evidence[0].text.startswith("bent: ")


def test_what_is_like_nothing_is_unknown() -> None:
    """Something that never happened before must not be told as the nearest of what did."""
    model = ImpactCauses.learn(*made(50))
    far = ImpactFeatures(np.concatenate([[30.0, -30.0, 30.0], np.zeros(len(NAMES) - 3)]), np.zeros(3))
    assert model.tell_features(far).cause == "unknown"


def test_missed() -> None:
    """Without an impact there is nothing to tell from but that."""
    aim = AimAware(PLAN)
    t = np.arange(0.3, 0.7, 1e-3)
    aim.run(t, np.tile(PANDA.home, (400, 1)), np.zeros((400, 7)), np.zeros((400, 7)))
    told = ImpactCauses.learn(*made(20)).tell(aim.result, PLAN, PANDA)
    assert (told.cause, told.confidence, told.tilt_deg) == ("missed", 1.0, None)


def test_saves_and_loads(tmp_path: Path) -> None:
    """A model is learnt once for a cell."""
    runs, causes = made(30)
    model = ImpactCauses.learn(runs, causes)
    model.save(tmp_path / "causes.npz")
    copy = ImpactCauses.load(tmp_path / "causes.npz")
    for run in runs[::10]:
        assert copy.tell_features(run).probabilities == model.tell_features(run).probabilities


def test_bad_input(tmp_path: Path) -> None:
    """Each mistake is told in one line."""
    runs, causes = made(20)
    with pytest.raises(TactfulError, match="give one each"):
        ImpactCauses.learn(runs, causes[:-1])
    with pytest.raises(TactfulError, match="only 5 runs of 'bent'"):
        ImpactCauses.learn(runs[:25], causes[:25])
    with pytest.raises(TactfulError, match="none of bent"):
        ImpactCauses.learn(runs[20:], causes[20:])
    with pytest.raises(TactfulError, match="no contact points"):
        impact_features(struck(np.zeros(6)), ImpactPlan(0.5, PANDA.home, [0.5], np.zeros((1, 7))), PANDA)
    with pytest.raises(TactfulError, match="there was none"):
        impact_features(AimAware(PLAN).result, PLAN, PANDA)
    np.savez(tmp_path / "other.npz", t=np.zeros(3))
    for path in (tmp_path / "none.npz", tmp_path / "other.npz"):
        with pytest.raises(TactfulError, match=r"cannot be read|not a model"):
            ImpactCauses.load(path)
