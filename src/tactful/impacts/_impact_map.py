"""Rigid impact maps: the joint velocity after an impact from the one before it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tactful.errors import TactfulError
from tactful.impacts._coulomb import solve_coulomb
from tactful.robots._frozen import FrozenRecord, frozen_array

Array = NDArray[np.float64]


class ImpactMapError(TactfulError):
    """An impact that cannot be solved: wrong shapes, dependent constraints where they must not be, no convergence."""


@dataclass(frozen=True, eq=False)
class ImpactResult(FrozenRecord):
    r"""What an impact does.

    Attributes:
        dq_plus: (n,) [rad/s] joint velocity after it.
        impulse_n: (c,) [Ns] normal impulses of the contact points on the robot; not unique where constraints depend on
            each other, while `dq_plus` is.
        impulse_t: (c, d) [Ns] tangential impulses.
        lost_j: kinetic energy that it took [J].
    """

    dq_plus: Array
    impulse_n: Array
    impulse_t: Array
    lost_j: float

    def __post_init__(self) -> None:
        for name in ("dq_plus", "impulse_n", "impulse_t"):
            object.__setattr__(self, name, frozen_array(getattr(self, name)))


def simultaneous_inelastic(M_r: ArrayLike, dq_minus: ArrayLike, J_N: ArrayLike) -> ImpactResult:
    r"""Return the frictionless, inelastic impact in which all points stay in contact, as equations with one solution.

    M_r (\dot q^+ - \dot q^-) = \sum_i J_{i,N}^T \Lambda_{N,i} with J_{i,N} \dot q^+ = 0 for all points, solved as (4)
    of Proper et al. 2023, https://hal.science/hal-03974694v3. An impulse comes out negative where the point would in
    truth leave the surface: `impact` keeps contacts unilateral.

    Args:
        M_r: (n, n) mass matrix of the rigid arm with the (shaped) inertia of its motors, M + B_theta [kg m^2].
        dq_minus: (n,) joint velocity before the impact [rad/s].
        J_N: (c, n) normal Jacobians of the points, along the normals out of the surface.

    Raises:
        ImpactMapError: if shapes do not fit or the constraints depend on each other.
    """
    M, v, J, _ = _checked(M_r, dq_minus, J_N, None)
    n, c = len(v), len(J)
    if np.linalg.matrix_rank(J) < c:
        raise ImpactMapError(
            f"{c} contact points on {n} joints constrain each other: use impact(), which may be given any"
        )
    A = np.block([[M, -J.T], [J, np.zeros((c, c))]])  # (n + c, n + c)
    solution = np.linalg.solve(A, np.concatenate([M @ v, np.zeros(c)]))
    dq_plus = solution[:n]
    return ImpactResult(dq_plus, solution[n:], np.zeros((c, 0)), _lost(M, v, dq_plus))


def impact(
    M_r: ArrayLike,
    dq_minus: ArrayLike,
    J_N: ArrayLike,
    J_T: ArrayLike | None = None,
    *,
    restitution: float = 0.0,
    friction: float | ArrayLike = 0.0,
) -> ImpactResult:
    r"""Return what a rigid impact at several points at once does, with restitution and Coulomb friction.

    Moreau's impact law. With \gamma = J \dot q and \xi = (\gamma^+ + e \gamma^-) / (1 + e), for every point

        0 <= \xi_N  \perp  \Lambda_N >= 0,     |\Lambda_T| <= \mu \Lambda_N,
        \Lambda_T = -\mu \Lambda_N \xi_T / |\xi_T|  where  \xi_T != 0.

    e = 0 is the inelastic impact; without friction it is `simultaneous_inelastic` wherever that pulls at no point. \xi
    solves the inelastic problem, and the impulses are 1 + e times those of it, so that for one e for all points,
    tangential directions included, the kinetic energy falls by at least (1 - e^2) / 2 \Lambda_0^T G \Lambda_0
    with the inelastic impulses \Lambda_0 and G = J M_r^-1 J^T: it never grows, whatever the friction. Points may be
    more than the degrees of freedom: G is then singular, the impulses are one choice of many, and without friction
    the motion is unique.

    Sources: J. J. Moreau 1988, doi:10.1007/978-3-7091-2624-0_1; C. Glocker 2006, doi:10.1007/3-211-38102-3_2 (ref. [18]
    of Proper et al. 2023, https://hal.science/hal-03974694v3). The solver: see `solve_coulomb`.

    Args:
        M_r: (n, n) mass matrix of the rigid arm with the (shaped) inertia of its motors, M + B_theta [kg m^2].
        dq_minus: (n,) joint velocity before the impact [rad/s].
        J_N: (c, n) normal Jacobians of the points, along the normals out of the surface.
        J_T: (c, d, n) tangential Jacobians, d = 1 in the plane and 2 in space; needed where there is friction.
        restitution: e in [0, 1], one for all.
        friction: mu >= 0, one for all points or (c,).

    Raises:
        ImpactMapError: if shapes do not fit, a coefficient is out of range, or no solution is found, as it may be
            where friction is so large that there is none.

    Example:
        >>> from tactful.impacts import impact
        >>> impact([[2.0]], [-0.3], [[1.0]], restitution=0.5).dq_plus
        array([0.15])
    """
    M, v, normal, tangent = _checked(M_r, dq_minus, J_N, J_T)
    c, d = tangent.shape[:2]
    mu = np.asarray(friction, dtype=np.float64)
    if mu.shape not in ((), (c,)) or not (np.isfinite(mu) & (mu >= 0)).all():
        raise ImpactMapError(f"friction is {mu.tolist()}: give one number >= 0, or one for each of the {c} points")
    if not 0 <= restitution <= 1:
        raise ImpactMapError(f"restitution is {restitution}: it has to be in [0, 1]")
    if mu.any() and d == 0:
        raise ImpactMapError("friction needs J_T, the tangential Jacobians (c, d, n)")
    J = np.concatenate([normal[:, None], tangent], axis=1).reshape(c * (1 + d), -1)  # a point after the other
    weighted = np.linalg.solve(M, J.T)  # (n, c (1 + d)) M_r^-1 J^T
    impulses = solve_coulomb(J @ weighted, J @ v, np.broadcast_to(mu, (c,)))  # (c, 1 + d)
    if impulses is None:
        problem = f"no solution found for mu up to {mu.max():g} on {c} points"
        raise ImpactMapError(f"impact with friction: {problem}; use a smaller friction or fewer points")
    impulses = (1.0 + restitution) * impulses
    dq_plus = v + weighted @ impulses.ravel()
    return ImpactResult(dq_plus, impulses[:, 0], impulses[:, 1:], _lost(M, v, dq_plus))


def _checked(
    M_r: ArrayLike, dq_minus: ArrayLike, J_N: ArrayLike, J_T: ArrayLike | None
) -> tuple[Array, Array, Array, Array]:
    M, v, N = (np.asarray(x, dtype=np.float64) for x in (M_r, dq_minus, J_N))
    n, c = len(v) if v.ndim == 1 else -1, len(N)
    T = np.zeros((c, 0, n)) if J_T is None else np.asarray(J_T, dtype=np.float64)
    if M.shape != (n, n) or N.shape != (c, n) or c == 0 or T.ndim != 3 or T.shape[::2] != (c, n) or T.shape[1] > 2:
        shapes = f"M_r {M.shape}, dq_minus {v.shape}, J_N {N.shape}, J_T {T.shape}"
        raise ImpactMapError(f"shapes do not fit: {shapes}; expected (n, n), (n,), (c, n), (c, 1 or 2, n)")
    if not all(np.isfinite(x).all() for x in (M, v, N, T)):
        raise ImpactMapError("M_r, dq_minus and the Jacobians have to be finite")
    if not np.allclose(M, M.T) or np.linalg.eigvalsh(M)[0] <= 0:
        raise ImpactMapError("M_r has to be symmetric and positive definite")
    return M, v, N, T


def _lost(M: Array, before: Array, after: Array) -> float:
    return float(0.5 * (before @ M @ before - after @ M @ after))
