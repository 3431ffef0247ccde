"""The external wrench against numpy's pseudo-inverse, and what it says near a singularity."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from numpy.typing import NDArray

from tactful.dynamics import Dynamics
from tactful.errors import TactfulError
from tactful.estimation import WrenchConfig, _wrench, external_wrench
from tactful.robots import Robot

Array = NDArray[np.float64]


def flat(J: Array, tau: Array, config: WrenchConfig | None = None) -> Array:
    """Return force and moment in one array (6,)."""
    wrench = external_wrench(J, tau, config)
    return np.concatenate([wrench.force_n, wrench.moment_nm])


def sigma_min(J: Array) -> float:
    """Return the smallest singular value, by SVD."""
    return float(np.linalg.svd(J, compute_uv=False)[-1])


def with_singular_values(values: Any, n: int, seed: int) -> Array:
    """A random (6, n) matrix with the given singular values."""
    rng = np.random.default_rng(seed)
    m = min(n, 6)
    U = np.linalg.qr(rng.standard_normal((6, 6)))[0]
    V = np.linalg.qr(rng.standard_normal((n, n)))[0]
    return np.asarray(U[:, :m] * np.asarray(values)[:m] @ V[:, :m].T)


@pytest.mark.parametrize("name", ["panda", "ur5e"])
def test_agrees_with_the_pseudo_inverse_away_from_singularities(name: str) -> None:
    """Where nothing is lost, the wrench is the least-squares one, and the flag says so."""
    robot = Robot.load(name)
    dynamics = Dynamics(robot)
    rng = np.random.default_rng(0)
    seen = 0
    for q in rng.uniform(-3, 3, (300, robot.n)):
        J = dynamics.jacobian(q)
        wrench = external_wrench(J, tau := rng.uniform(-30, 30, robot.n))
        assert wrench.sigma_min == pytest.approx(sigma_min(J), rel=1e-9)
        if wrench.sigma_min > 0.03 * math.sqrt(6):
            seen += 1
            assert not wrench.damped
            expected = np.linalg.pinv(J.T) @ tau
            assert_allclose(flat(J, tau), expected, rtol=0, atol=1e-10 * np.linalg.norm(expected))
    assert seen > 100


@pytest.mark.parametrize("name", ["panda", "ur5e"])
def test_wrench_that_acts_is_found(name: str) -> None:
    """J^T F is what a wrench does to the joints: its inverse has to return it, with its sign and its units."""
    robot = Robot.load(name)
    J = Dynamics(robot).jacobian(robot.home)
    F = np.array([12.0, -7.0, 30.0, 0.5, 2.0, -1.0])
    assert_allclose(flat(J, J.T @ F), F, atol=1e-10)


def test_fewer_than_six_joints_give_the_least_norm() -> None:
    """Three joints cannot know six numbers: of all wrenches that explain the torque, the smallest."""
    rng = np.random.default_rng(1)
    for _ in range(100):
        J, tau = rng.standard_normal((6, 3)), rng.uniform(-30, 30, 3)
        wrench = external_wrench(J, tau)
        assert not wrench.damped
        assert_allclose(flat(J, tau), np.linalg.pinv(J.T) @ tau, rtol=1e-10, atol=1e-10)
        assert_allclose(J.T @ flat(J, tau), tau, atol=1e-10)
        assert wrench.sigma_min == pytest.approx(sigma_min(J), rel=1e-9)


@given(
    n=st.sampled_from([3, 6, 7]),
    exponents=st.lists(st.floats(-5, 1), min_size=6, max_size=6),
    seed=st.integers(0, 1000),
)
@settings(deadline=None)
def test_bound_on_the_smallest_singular_value(n: int, exponents: list[float], seed: int) -> None:
    """The kernel damps by a bound that costs no SVD: it must never be above sigma_min, nor far below."""
    J = with_singular_values(10.0 ** np.array(exponents), n, seed)
    record: Any = _wrench.wrench_record(n, WrenchConfig())
    _wrench.solve_wrench(record[0], J, np.ones(n))
    bound, exact = float(record["sigma_bound"][0]), sigma_min(J)
    rounding = 1e-14 * np.trace(J.T @ J) / exact**2  # relative, of the bound's square
    assert exact / math.sqrt(min(n, 6)) * (1 - 10 * rounding - 1e-9) <= bound <= exact * (1 + 10 * rounding + 1e-9)


@given(
    n=st.sampled_from([3, 6, 7]),
    exponents=st.lists(st.floats(-1.7, 0.5), min_size=6, max_size=6),
    seed=st.integers(0, 1000),
    damped_below=st.floats(0.005, 0.5),
    damping=st.floats(0.005, 0.2),
)
@settings(deadline=None)
def test_damping_is_that_of_the_equation(
    n: int, exponents: list[float], seed: int, damped_below: float, damping: float
) -> None:
    """The damped solution, with numpy: lambda grows from 0 at `damped_below` to `damping` at the singularity."""
    J = with_singular_values(10.0 ** np.array(exponents), n, seed)
    tau = np.random.default_rng(seed).uniform(-10, 10, n)
    singular = np.linalg.svd(J, compute_uv=False)
    s = 1 / np.linalg.norm(1 / singular)  # ||L^-1||_F is that of J^+
    lambda2 = damping**2 * (1 - (s / damped_below) ** 2) if s < damped_below else 0.0
    expected = J @ np.linalg.solve(J.T @ J + lambda2 * np.eye(n), tau) if lambda2 else np.linalg.pinv(J.T) @ tau
    wrench = external_wrench(J, tau, WrenchConfig(damped_below=damped_below, damping=damping))
    if abs(s / damped_below - 1) > 1e-3:
        assert wrench.damped == (s < damped_below)
        error = np.linalg.norm([*(wrench.force_n - expected[:3]), *(wrench.moment_nm - expected[3:])])
        assert error <= 1e-6 * np.linalg.norm(expected) + 1e-9


def test_solution_is_continuous_where_damping_begins() -> None:
    """A force that jumped at the limit would look like contact."""
    J = with_singular_values([1, 1, 1, 1, 1, 1], 7, 0)
    U, _, Vt = np.linalg.svd(J, full_matrices=False)
    tau = np.linspace(-5, 5, 7)
    limit = 0.03
    near = []
    for smallest in limit * np.array([1 - 1e-7, 1 + 1e-7]):
        J = (U * [1, 1, 1, 1, 1, smallest]) @ Vt
        bound = 1 / np.linalg.norm([1, 1, 1, 1, 1, 1 / smallest])
        near.append((flat(J, tau, WrenchConfig(damped_below=limit * bound / smallest)), smallest))
    assert_allclose(near[0][0], near[1][0], rtol=1e-4, atol=1e-4)


@pytest.mark.parametrize("distance", [0.1, 1e-2, 1e-4, 1e-8, 0.0])
@pytest.mark.parametrize(("name", "stretched"), [("panda", np.zeros(7)), ("ur5e", np.zeros(6))])
def test_near_a_singularity_the_force_is_finite_and_flagged(name: str, stretched: Array, distance: float) -> None:
    """At a stretched arm a direction of the force is lost: neither infinite, nor silently zero, nor an error."""
    robot = Robot.load(name)
    J = Dynamics(robot).jacobian(stretched + distance * np.linspace(0.5, 1, robot.n))
    tau = np.linspace(-5, 5, robot.n)
    wrench = external_wrench(J, tau)
    F = np.array([*wrench.force_n, *wrench.moment_nm])
    assert np.isfinite(F).all()
    assert wrench.sigma_min == pytest.approx(sigma_min(J), abs=1e-12)
    assert wrench.damped == (1 / np.linalg.norm(1 / np.maximum(np.linalg.svd(J, compute_uv=False), 1e-9)) < 0.03)
    if distance <= 1e-2:
        assert wrench.damped
    assert np.linalg.norm(F) > 1
    assert np.linalg.norm(F) <= np.linalg.norm(tau) / (2 * 0.03) * 1.1, (
        "1 / (2 lambda) is the most that damping lets pass"
    )


@pytest.mark.parametrize("n", [3, 6, 7])
@pytest.mark.parametrize("lost", [1, 2, 3])
def test_exactly_singular_matrices(n: int, lost: int) -> None:
    """Rank that is lost exactly: the part of the force that the joints do feel is still right within the damping."""
    J = with_singular_values([1.0] * (min(n, 6) - lost) + [0.0] * lost, n, lost)
    F = J @ np.arange(1.0, n + 1)  # a wrench that the joints feel
    wrench = external_wrench(J, J.T @ F)
    assert wrench.damped
    assert wrench.sigma_min == pytest.approx(0, abs=1e-12)
    assert_allclose([*wrench.force_n, *wrench.moment_nm], F / (1 + 0.03**2), atol=1e-9)


def test_no_jacobian_at_all_is_flagged() -> None:
    """A tip on the base feels nothing: no force, and not a silent one."""
    wrench = external_wrench(np.zeros((6, 7)), np.ones(7))
    assert wrench.damped
    assert wrench.sigma_min == 0
    assert not wrench.force_n.any()


def test_damping_can_be_switched_off() -> None:
    """Someone who compares with plain least squares wants no damping, however large the force."""
    J = with_singular_values([1, 1, 1, 1, 1, 1e-3], 7, 0)
    tau = np.linspace(-5, 5, 7)
    config = WrenchConfig(damped_below=0)
    assert not external_wrench(J, tau, config).damped
    assert_allclose(flat(J, tau, config), np.linalg.pinv(J.T) @ tau, rtol=1e-6)


@pytest.mark.parametrize(
    ("J", "tau"),
    [
        (np.ones((6, 7)), np.ones(6)),
        (np.ones((7, 6)), np.ones(6)),
        (np.ones((3, 7)), np.ones(7)),
        (np.ones(6), np.ones(6)),
        (np.ones((6, 7)), np.ones((7, 1))),
        (np.ones((6, 0)), np.ones(0)),
        (np.ones((2, 6, 7)), np.ones(7)),
    ],
)
def test_wrong_shapes_are_named(J: Array, tau: Array) -> None:
    """A transposed Jacobian of a six-joint arm has the right size for the wrong answer; the others would crash."""
    with pytest.raises(TactfulError) as caught:
        external_wrench(J, tau)
    assert str(caught.value) == f"J has shape {J.shape} and tau_ext {tau.shape}: they must be (6, n) and (n,)"


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_numbers_that_are_not_finite_are_refused(bad: float) -> None:
    """They ended in "SVD did not converge" from deep inside numpy."""
    for J, tau in ((np.full((6, 7), bad), np.ones(7)), (np.ones((6, 7)), np.full(7, bad))):
        with pytest.raises(TactfulError, match="not finite"):
            external_wrench(J, tau)


def test_any_input_array_runs_the_one_compiled_kernel() -> None:
    """Numba compiles anew for read-only or strided arrays: seconds in the middle of a control loop."""
    J = np.random.default_rng(3).standard_normal((6, 7))
    external_wrench(J, np.ones(7))
    compiled = len(_wrench.solve_wrench.signatures)
    frozen = J.copy()
    frozen.flags.writeable = False
    for odd in (frozen, np.asfortranarray(J), J.tolist(), J.astype(np.float32)):
        external_wrench(odd, [1] * 7)
    assert len(_wrench.solve_wrench.signatures) == compiled
