"""Unilateral contacts with Coulomb friction: the impulses at several points at once."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tactful._njit import njit

Array = NDArray[np.float64]

_ROUNDS, _SWEEPS, _NEWTON_STEPS = 40, 50, 30
_TOLERANCE = 1e-11
"""Of the contact velocities, as a share of the largest that there would be without impulses."""


def solve_coulomb(G: Array, free: Array, mu: Array) -> Array | None:
    r"""Return impulses \Lambda (c, 1 + d) that obey Signorini's and Coulomb's law, or None if none are found.

    With \xi = G \Lambda + \xi_free, 0 <= \xi_N \perp \Lambda_N >= 0, |\Lambda_T| <= \mu \Lambda_N, and \Lambda_T
    against \xi_T where that is not zero: a cone complementarity problem that is no convex program for mu > 0, since
    Coulomb's cone is not the dual of itself.

    Gauss-Seidel sweeps over the points, each projected onto its cone, come near the solution, whatever the rank of G;
    Newton's method on the projections then meets it to rounding.

    Sources: M. Jean 1999, doi:10.1016/S0045-7825(98)00383-1 (sweeps); P. Alart, A. Curnier 1991,
    doi:10.1016/0045-7825(91)90022-X (Newton).

    Args:
        G: (c (1 + d), c (1 + d)) inverse inertia that the points feel, a point after the other, its normal first.
        free: (c (1 + d),) velocities of the points without impulses.
        mu: (c,) coefficients of friction.
    """
    c = len(mu)
    impulse = np.zeros((c, len(free) // c))
    G, free, mu = (np.ascontiguousarray(x, dtype=np.float64).copy() for x in (G, free, mu))
    most = _TOLERANCE * max(float(np.abs(free).max()), 1e-300)
    own = np.maximum(G.diagonal().reshape(impulse.shape), 1e-300).copy()
    own[:, 1:] = own[:, 1:].sum(axis=1, keepdims=True)  # the largest eigenvalue of the tangential block, or more
    for _ in range(_ROUNDS):
        if _sweep(G, free, mu, own, impulse, _SWEEPS) <= most:
            return impulse
        polished = _newton(G, free, mu, own, impulse, most)
        if polished is not None:
            return polished
    return None


@njit(cache=True)
def _sweep(G: Array, free: Array, mu: Array, own: Array, impulse: Array, times: int) -> float:
    """Sweep over the points, and return the largest change of the last sweep [m/s]."""
    c, m = impulse.shape
    change = 0.0
    step = np.empty(m)
    for _ in range(times):
        change = 0.0
        for i in range(c):
            size = 0.0
            for a in range(m):
                velocity = free[i * m + a]
                for j in range(c):
                    for b in range(m):
                        velocity += G[i * m + a, j * m + b] * impulse[j, b]
                if a == 0:
                    step[0] = max(0.0, impulse[i, 0] - velocity / own[i, 0])
                    change = max(change, abs(step[0] - impulse[i, 0]) * own[i, 0])
                    impulse[i, 0] = step[0]  # the tangential directions see it at once
                else:
                    step[a] = impulse[i, a] - velocity / own[i, a]
                    size += step[a] * step[a]
            size, most = np.sqrt(size), mu[i] * impulse[i, 0]
            for a in range(1, m):
                kept = step[a] * most / size if size > most else step[a]
                change = max(change, abs(kept - impulse[i, a]) * own[i, a])
                impulse[i, a] = kept
    return change


def _newton(G: Array, free: Array, mu: Array, own: Array, start: Array, most: float) -> Array | None:
    """Return the root of own (Lambda - projection of Lambda - xi / own) near `start`, or None."""
    c, m = start.shape
    impulse = start.copy()
    for _ in range(_NEWTON_STEPS):
        residual, slope = np.zeros(c * m), np.zeros((c * m, c * m))
        velocity = (G @ impulse.ravel() + free).reshape(c, m)
        for i in range(c):
            row, size = i * m, m - 1
            if impulse[i, 0] * own[i, 0] > velocity[i, 0]:  # in contact
                residual[row], slope[row] = velocity[i, 0], G[row]
            else:
                residual[row], slope[row, row] = own[i, 0] * impulse[i, 0], own[i, 0]
            if size == 0:
                continue
            here, k = slice(row + 1, row + m), own[i, 1]
            trial = impulse[i, 1:] - velocity[i, 1:] / k  # (d,)
            length, bound = float(np.linalg.norm(trial)), mu[i] * max(impulse[i, 0], 0.0)
            if length <= bound:  # sticks
                residual[here], slope[here] = velocity[i, 1:], G[here]
                continue
            along = trial / length
            turn = bound / length * (np.eye(size) - np.outer(along, along))  # d projection / d trial
            d_trial = -G[here] / k
            d_trial[:, here] += np.eye(size)
            residual[here] = k * (impulse[i, 1:] - bound * along)
            slope[here] = -k * turn @ d_trial
            slope[here, here] += k * np.eye(size)
            if impulse[i, 0] > 0.0:
                slope[here, row] -= k * mu[i] * along
        if np.abs(residual).max() <= most:
            impulse[:, 0] = np.maximum(impulse[:, 0], 0.0)
            return impulse
        step, *_ = np.linalg.lstsq(slope, residual, rcond=1e-13)
        impulse = impulse - step.reshape(c, m)
        if not np.isfinite(impulse).all():
            return None
    return None
