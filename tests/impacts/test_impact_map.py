"""Rigid impact maps."""

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp
from scipy.optimize import nnls

from tactful import Robot
from tactful.dynamics import Dynamics
from tactful.impacts import ImpactMapError, damping_for, impact, simultaneous_inelastic

Problem = tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]


def _problem(seed: int, n: int, c: int, d: int) -> Problem:
    rng = np.random.default_rng(seed)
    A = rng.normal(size=(n, n))
    return A @ A.T + np.eye(n), rng.normal(size=n), rng.normal(size=(c, n)), rng.normal(size=(c, d, n))


CASES = st.tuples(st.integers(0, 10**6), st.integers(1, 7), st.integers(1, 6), st.integers(1, 2))


@settings(max_examples=60, deadline=None)
@given(CASES)
def test_frictionless_is_the_nearest_motion_that_does_not_penetrate(case: tuple[int, int, int, int]) -> None:
    """NNLS of scipy solves the dual of min |dq+ - dq-|_M with J dq+ >= 0; points may be more than joints."""
    M, v, J, _ = _problem(*case)
    L = np.linalg.cholesky(M)
    impulse, _ = nnls(np.linalg.solve(L, J.T), -L.T @ v)
    np.testing.assert_allclose(impact(M, v, J).dq_plus, v + np.linalg.solve(M, J.T @ impulse), atol=1e-8)


@settings(max_examples=100, deadline=None)
@given(CASES, st.floats(0, 0.3), st.floats(0, 1))
def test_obeys_the_laws(case: tuple[int, int, int, int], mu: float, e: float) -> None:
    """Momentum, Signorini, Coulomb, maximum dissipation; and energy falls by the bound that is told."""
    M, v, J, T = _problem(*case)
    try:
        result = impact(M, v, J, T, restitution=e, friction=mu)
    except ImpactMapError:  # random constraints and friction may have no solution
        return
    momentum = J.T @ result.impulse_n + np.einsum("cdn,cd->n", T, result.impulse_t)
    np.testing.assert_allclose(M @ (result.dq_plus - v), momentum, atol=1e-8)
    scale = 1 + np.abs(J @ v).max()
    xi = J @ (result.dq_plus + e * v) / scale
    assert (xi > -1e-8).all()
    assert (result.impulse_n >= 0).all()
    assert np.abs(xi * result.impulse_n).max() < 1e-6 * (1 + result.impulse_n.max())
    size = np.linalg.norm(result.impulse_t, axis=1)
    assert (size <= mu * result.impulse_n + 1e-9).all()
    xi_t = np.einsum("cdn,n->cd", T, result.dq_plus + e * v)
    dissipated = -np.einsum("cd,cd->c", xi_t, result.impulse_t)
    np.testing.assert_allclose(dissipated, mu * result.impulse_n * np.linalg.norm(xi_t, axis=1), atol=1e-6 * scale**2)
    G_L = momentum / (1 + e)
    assert result.lost_j >= 0.5 * (1 - e * e) * G_L @ np.linalg.solve(M, G_L) - 1e-8 * scale**2


def _by_modes(M: np.ndarray, v: np.ndarray, J: np.ndarray, T: np.ndarray, mu: float) -> list[np.ndarray]:
    """Solve the planar inelastic impact by trying all modes: each point open, sticking, or sliding one way."""
    found = []
    inverse = np.linalg.inv(M)
    for modes in itertools.product("osrl", repeat=len(J)):
        push, hold = [], []  # directions of unknown impulses, and rows whose velocity is zero
        for i, mode in enumerate(modes):
            if mode == "s":
                push += [J[i], T[i, 0]]
                hold += [J[i], T[i, 0]]
            elif mode != "o":
                push.append(J[i] + (-mu if mode == "r" else mu) * T[i, 0])
                hold.append(J[i])
        after = v
        impulse = np.zeros(0)
        if push:
            P, H = np.array(push), np.array(hold)
            G = H @ inverse @ P.T
            if np.linalg.cond(G) > 1e10:
                continue
            impulse = np.linalg.solve(G, -H @ v)
            after = v + inverse @ P.T @ impulse
        good, k = True, 0
        for i, mode in enumerate(modes):
            if mode == "o":
                good &= J[i] @ after > -1e-9
                continue
            normal, k = impulse[k], k + 1
            good &= normal > -1e-9
            if mode == "s":
                good &= abs(impulse[k]) <= mu * normal + 1e-9
                k += 1
            else:
                good &= (1 if mode == "r" else -1) * (T[i, 0] @ after) > -1e-9
        if good:
            found.append(after)
    return found


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 10**6), st.integers(1, 3), st.floats(0.01, 0.5))
def test_friction_agrees_with_the_enumeration_of_all_modes(seed: int, c: int, mu: float) -> None:
    """An independent solver of the plane: 4^c linear systems."""
    M, v, J, T = _problem(seed, 5, c, 1)
    solutions = _by_modes(M, v, J, T, mu)
    if not solutions:
        return
    after = impact(M, v, J, T, friction=mu).dq_plus
    assert min(np.abs(after - solution).max() for solution in solutions) < 1e-7


FLAT = Robot.load("panda")
Q = FLAT.home
DYNAMICS = Dynamics(FLAT)
M_R = DYNAMICS.mass_matrix(Q) + np.diag([0.6, 0.6, 0.5, 0.5, 0.2, 0.2, 0.2])


def _points(count: int) -> tuple[np.ndarray, np.ndarray]:
    """Jacobians of points on a ring about the tip, pressed against a horizontal surface."""
    pose = DYNAMICS.pose(Q)[1]
    link = FLAT.frames[FLAT.tip].link
    angles = 2 * np.pi * np.arange(count) / count
    rows = [DYNAMICS.jacobian_at(Q, link, pose + 0.05 * np.array([np.cos(a), np.sin(a), 0.0]))[:3] for a in angles]
    return np.array([row[2] for row in rows]), np.array([row[:2] for row in rows])


DQ = np.linalg.pinv(DYNAMICS.jacobian(Q)) @ np.array([0.05, 0.0, -0.3, 0.0, 0.0, 0.0])


def test_equations_of_the_paper() -> None:
    """(4) of the paper is the impact of points that all stay: momentum, no velocity into the surface, energy falls."""
    J_N, _ = _points(3)
    result = simultaneous_inelastic(M_R, DQ, J_N)
    np.testing.assert_allclose(J_N @ result.dq_plus, 0, atol=1e-12)
    np.testing.assert_allclose(M_R @ (result.dq_plus - DQ), J_N.T @ result.impulse_n, atol=1e-12)
    assert result.lost_j > 0
    if (result.impulse_n > 0).all():
        np.testing.assert_allclose(impact(M_R, DQ, J_N).dq_plus, result.dq_plus, atol=1e-9)


def test_more_points_than_freedoms_are_a_surface() -> None:
    """Three points on a plane define it; a ring of twenty dependent ones moves alike where all of three press."""
    three = impact(M_R, DQ, _points(3)[0])
    many = impact(M_R, DQ, _points(20)[0])
    surface = DYNAMICS.jacobian(Q)[[2, 3, 4]]
    assert np.abs(surface @ simultaneous_inelastic(M_R, DQ, _points(3)[0]).dq_plus).max() < 1e-9
    assert (_points(20)[0] @ many.dq_plus > -1e-9).all()
    assert many.lost_j >= three.lost_j - 1e-9
    with pytest.raises(ImpactMapError, match="constrain each other"):
        simultaneous_inelastic(M_R, DQ, _points(4)[0])


def test_friction_on_a_ring_of_dependent_points() -> None:
    """Six points and friction in space: the tip slows along the surface, and no more than friction can."""
    J_N, J_T = _points(6)
    smooth, rough = impact(M_R, DQ, J_N), impact(M_R, DQ, J_N, J_T, friction=0.2)
    assert (J_N @ rough.dq_plus > -1e-9).all()
    size = np.linalg.norm(rough.impulse_t, axis=1)
    assert (size <= 0.2 * rough.impulse_n + 1e-9).all()
    assert size.max() > 0
    assert not np.allclose(rough.dq_plus, smooth.dq_plus)


def _compliant(M: np.ndarray, v: np.ndarray, N: np.ndarray, T: np.ndarray, k: float, e: float, mu: float) -> np.ndarray:
    """Integrate the rigid arm in one place against compliant points, and return the velocity when all have rested."""
    n, c = len(v), len(N)
    d = damping_for(e, 0.3)

    def slope(t: float, s: np.ndarray) -> np.ndarray:
        depth, dq = s[:c], s[c:]
        closing = -N @ dq
        law = np.where(closing >= 0, 1 + d * closing, np.exp(np.minimum(d * closing, 0)))
        F = k * np.maximum(depth, 0) ** 1.5 * law
        F_t = -mu * F * np.tanh(T[:, 0] @ dq / 1e-4)
        return np.concatenate([closing, np.linalg.solve(M, N.T @ F + T[:, 0].T @ F_t)])

    way = solve_ivp(slope, (0, 60.0 * k**-0.4), np.r_[np.zeros(c), v], method="LSODA", rtol=1e-8, atol=1e-12)
    assert way.y.shape[0] == n + c
    return np.asarray(way.y[c:, -1])


@pytest.mark.parametrize("mu", [0.0, 0.1])
@pytest.mark.parametrize("k", [1e6, 1e9])
def test_a_compliant_ball_does_what_the_map_says(mu: float, k: float) -> None:
    """Restitution, and friction of a ball that slides throughout, in one place; stiffness scales the time alone."""
    J_N, J_T = (rows[:1] for rows in _points(3))
    J_T = J_T[:, :1]
    v = np.linalg.pinv(np.concatenate([J_N, J_T[:, 0]])) @ np.array([-0.3, 0.5])
    e = 0.3
    felt = _compliant(M_R, v, J_N, J_T, k, e, mu)
    told = impact(M_R, v, J_N, J_T, restitution=float((J_N @ felt)[0] / 0.3), friction=mu)
    np.testing.assert_allclose(felt, told.dq_plus, atol=1e-6)
    if mu == 0:
        np.testing.assert_allclose(J_N @ felt, [0.3 * e], rtol=1e-4)


def test_units_of_the_simplest_impact() -> None:
    """A mass on a wall."""
    result = impact([[2.0]], [-0.3], [[1.0]], restitution=0.5)
    assert result.dq_plus[0] == pytest.approx(0.15)
    assert result.impulse_n[0] == pytest.approx(0.9)
    assert result.lost_j == pytest.approx(0.09 - 0.0225)
    assert impact([[2.0]], [0.3], [[1.0]]).dq_plus[0] == pytest.approx(0.3)  # it was leaving


@pytest.mark.parametrize(
    ("change", "match"),
    [
        ({"M_r": np.eye(2)}, "shapes"),
        ({"M_r": -np.eye(1)}, "positive definite"),
        ({"dq_minus": [np.nan]}, "finite"),
        ({"restitution": 1.5}, "restitution"),
        ({"friction": -0.1}, "friction"),
        ({"friction": 0.1}, "J_T"),
    ],
)
def test_bad_input(change: dict[str, object], match: str) -> None:
    """One line says what is wrong."""
    arguments: dict[str, object] = {"M_r": np.eye(1), "dq_minus": [-1.0], "J_N": [[1.0]]}
    with pytest.raises(ImpactMapError, match=match):
        impact(**(arguments | change))  # type: ignore[arg-type]
