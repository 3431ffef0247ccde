"""How hard: the posterior of the wrench, its honesty near singularities, the bias, and a real robot."""

from __future__ import annotations

import numpy as np
import pytest

from tactful import Robot
from tactful.dynamics import Dynamics
from tactful.estimation import external_wrench
from tactful.isolation import BiasTracker, IsolationError, WrenchPrior, identify_wrench
from tests._counterparts import require_shared_data
from tests.isolation._pad import pressed

PANDA = Robot.load("panda")


def test_estimate_is_the_conditional_gaussian() -> None:
    """An independent way: least squares on the stacked equations of torque and prior."""
    rng = np.random.default_rng(0)
    J, tau = rng.normal(size=(6, 7)), rng.normal(size=7)
    half = rng.normal(size=(7, 7))
    Sigma = half @ half.T + 0.1 * np.eye(7)
    found = identify_wrench(J, tau, Sigma, WrenchPrior(force_n=3.0, moment_nm=0.5))
    information = J @ np.linalg.solve(Sigma, J.T) + np.diag([1 / 9] * 3 + [4.0] * 3)
    expected = np.linalg.solve(information, J @ np.linalg.solve(Sigma, tau))
    np.testing.assert_allclose([*found.force_n, *found.moment_nm], expected, atol=1e-10)
    np.testing.assert_allclose(found.covariance, np.linalg.inv(information), atol=1e-10)


def test_weak_prior_gives_the_pseudo_inverse() -> None:
    """Where the torque tells all, the prior must not be felt."""
    J = Dynamics(PANDA).jacobian(PANDA.home)
    tau = J.T @ [5.0, -3.0, 10.0, 0.2, 0.1, -0.1]
    found = identify_wrench(J, tau, 1e-8 * np.eye(7), WrenchPrior(force_n=1e4, moment_nm=1e4))
    reference = external_wrench(J, tau)
    np.testing.assert_allclose(found.force_n, reference.force_n, atol=1e-5)
    np.testing.assert_allclose(found.moment_nm, reference.moment_nm, atol=1e-5)
    assert found.observed.all()
    assert found.sigma_min == pytest.approx(reference.sigma_min)


def test_lost_direction_keeps_the_prior_and_says_so() -> None:
    """A stretched arm does not feel a push along itself: the estimate must not be a small force with a small error."""
    q = np.zeros(7)
    J = Dynamics(PANDA).jacobian(q)
    scale = np.repeat([20.0, 0.3], 3)
    lost = scale * np.linalg.svd(scale[:, None] * J)[0][:, -1]  # what the torque does not tell, in units of the prior
    found = identify_wrench(J, J.T @ lost)
    assert found.sigma_min < 0.01
    assert not found.observed.all()
    direction = lost / np.linalg.norm(lost / scale) / scale
    variance = (direction / scale) @ found.covariance @ (direction / scale)
    assert variance > 0.9  # of 1 before
    assert ((found.interval[:, 0] < lost) & (lost < found.interval[:, 1])).all()


def test_intervals_hold_what_they_promise() -> None:
    """The prior and the noise are what the simulation draws from, so 90 % intervals have to hold the truth in 90 %."""
    rng = np.random.default_rng(1)
    dynamics, inside, trials = Dynamics(PANDA), 0, 400
    for _ in range(trials):
        J = dynamics.jacobian(rng.uniform(np.maximum(PANDA.lower, -3), PANDA.upper))
        F = rng.normal(size=6) * [20, 20, 20, 0.3, 0.3, 0.3]
        found = identify_wrench(J, J.T @ F + 0.1 * rng.normal(size=7))
        inside += int(((found.interval[:, 0] < F) & (found.interval[:, 1] > F)).sum())
    assert inside / (6 * trials) == pytest.approx(0.9, abs=0.02)


def test_zero_torque_is_zero_force() -> None:
    """The direction of no force is not defined; its magnitude is."""
    found = identify_wrench(Dynamics(PANDA).jacobian(PANDA.home), np.zeros(7))
    assert found.magnitude_n == 0
    assert 0 < found.magnitude_interval_n[1] < 10


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((np.zeros((6, 7)), np.zeros(6)), "must be"),
        ((np.zeros((3, 7)), np.zeros(7)), "must be"),
        ((np.ones((6, 7)), np.full(7, np.inf)), "not finite"),
        ((np.ones((6, 7)), np.ones(7), np.eye(6)), "covariance has shape"),
        ((np.ones((6, 7)), np.ones(7), -np.eye(7)), "not positive definite"),
    ],
)
def test_bad_input_is_told(arguments: tuple[np.ndarray, ...], message: str) -> None:
    """Some of these would be broadcast to an answer."""
    with pytest.raises(IsolationError, match=message):
        identify_wrench(*arguments)


def test_bias_is_followed_at_rest_and_kept_in_contact() -> None:
    """A bias that follows the contact would make it vanish; one that stays behind would make one up afterwards."""
    tracker = BiasTracker(2)
    for k in range(200):
        tracker.update(0.01 * k, [0.2, -0.1], contact=False)
    np.testing.assert_allclose(tracker.bias, [0.2, -0.1])
    for k in range(200, 400):
        np.testing.assert_allclose(tracker.update(0.01 * k, [3.2, -0.1], contact=True), [3.0, 0.0], atol=1e-12)
        assert tracker.frozen
    for k in range(400, 420):  # hysteresis left another bias behind
        rest = tracker.update(0.01 * k, [0.35, -0.1], contact=False)
    np.testing.assert_allclose(rest, 0.0, atol=1e-12)
    assert not tracker.frozen
    assert not tracker.at_limit


def test_rise_before_the_detection_is_not_bias() -> None:
    """A contact is detected after it begins; what it did until then must not be subtracted from it."""
    tracker = BiasTracker(1, guard_s=0.05)
    for k in range(100):
        tracker.update(0.001 * k, [0.0], contact=False)
    for k in range(100, 140):
        tracker.update(0.001 * k, [2.0], contact=False)  # not detected yet
    assert tracker.update(0.14, [2.0], contact=True) == pytest.approx(2.0)


def test_bias_is_bounded() -> None:
    """A constant push that nobody detected must not be called a bias without end."""
    tracker = BiasTracker(1, limit_nm=0.5)
    for k in range(300):
        rest = tracker.update(0.01 * k, [2.0], contact=False)
    assert rest == pytest.approx(1.5)
    assert tracker.at_limit


def test_bad_samples_and_settings_of_the_bias_are_told() -> None:
    """One NaN would stay in the mean for ever."""
    with pytest.raises(IsolationError, match="not finite"):
        BiasTracker(1).update(0.0, [np.nan], contact=False)
    with pytest.raises(IsolationError, match="has shape"):
        BiasTracker(2).update(0.0, [1.0], contact=False)
    with pytest.raises(IsolationError, match="must be positive"):
        BiasTracker(2, limit_nm=0.0)


def test_force_at_a_real_end_effector() -> None:
    """Against a force/torque sensor: 0.40 N RMS, one press found in each of the recordings, none invented."""
    presses = [pressed(path) for path in sorted((require_shared_data() / "panda_tactile_pad").glob("*.csv"))]
    error = np.concatenate([press.force_n - press.truth_n for press in presses])  # (k, 3)
    assert np.sqrt((error**2).sum(axis=1).mean()) < 0.40
    assert (np.sqrt((error**2).mean(axis=0)) < [0.12, 0.30, 0.26]).all()
    assert [int((np.diff(press.contact.astype(int)) == 1).sum()) for press in presses] == [1] * 4
