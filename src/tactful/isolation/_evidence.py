r"""The evidence of an external joint torque for a contact at each point of the surface: allocation-free kernels.

A force f at the point x of link l, both in the link's frame, makes the torque A f with A = U (1, [x])^T; the rows of
U (n, 6) are what a wrench about the link's origin does at each joint. With f ~ N(m u, S), u the inward normal,

    S = (m/2)^2 u u^T + (mu m/2)^2 (1 - u u^T),

the torque is N(m A u, A S A^T + Sigma), whose logarithm needs no more than 3 x 3 algebra once U^T Sigma^-1 U and
U^T Sigma^-1 tau are known (matrix determinant lemma, Woodbury): with G = A^T Sigma^-1 A, c = A^T Sigma^-1 tau and
b = c - m G u,

    -2 log p = tau^T Sigma^-1 tau - 2 m u.c + m^2 u.G u - b^T (S^-1 + G)^-1 b
               + log det(S (S^-1 + G)) + log det(2 pi Sigma).

A point stands for the surface around it: the moment of a force m that is displaced by the standard deviation `spread_m`
is added to Sigma, by link and magnitude, and the turn of the normal to the tangential part of S.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from tactful._njit import njit

Array = NDArray[np.float64]

_FAST = {"reassoc", "contract", "nsz", "arcp"}  # not nnan: a pose that is not finite must show


@njit(cache=True)
def whiten(Sigma: Array, tau: Array, V: Array, y: Array) -> float:
    """Set the upper V with V V^T = Sigma and y = V^-1 tau; return log det(2 pi Sigma), nan if it is not positive."""
    n = tau.shape[0]
    total = n * np.log(2.0 * np.pi)
    for j in range(n - 1, -1, -1):
        for i in range(j, -1, -1):
            value = Sigma[i, j]
            for k in range(j + 1, n):
                value -= V[i, k] * V[j, k]
            if i == j:
                if not value > 0.0:
                    return np.nan
                V[j, j] = np.sqrt(value)
                total += np.log(value)
            else:
                V[i, j] = value / V[j, j]
    for i in range(n - 1, -1, -1):
        value = tau[i]
        for k in range(i + 1, n):
            value -= V[i, k] * y[k]
        y[i] = value / V[i, i]
    return float(total)


@njit(cache=True)
def whiten_link(arm: Any, motion: Any, link: int, V: Array, U: Array) -> None:
    """Set U (n, 6) to V^-1 times what a wrench on a link, in its frame about its origin, does at each joint.

    V is upper triangular, so the rows beyond the link are not needed.
    """
    R, o = motion.R[link], motion.o
    for i in range(link, -1, -1):
        z = motion.z[i]
        a0, a1, a2 = z[0], z[1], z[2]
        if arm.prismatic[i]:
            v0, v1, v2 = a0, a1, a2
            a0 = a1 = a2 = 0.0
        else:
            d0, d1, d2 = o[link, 0] - o[i, 0], o[link, 1] - o[i, 1], o[link, 2] - o[i, 2]
            v0, v1, v2 = a1 * d2 - a2 * d1, a2 * d0 - a0 * d2, a0 * d1 - a1 * d0
        for r in range(3):
            U[i, r] = R[0, r] * v0 + R[1, r] * v1 + R[2, r] * v2
            U[i, r + 3] = R[0, r] * a0 + R[1, r] * a1 + R[2, r] * a2
        for r in range(6):
            value = U[i, r]
            for k in range(i + 1, link + 1):
                value -= V[i, k] * U[k, r]
            U[i, r] = value / V[i, i]


@njit(cache=True)
def invert(a: float, b: float, c: float, d: float, e: float, f: float, K: Array) -> float:
    """Set K to the inverse of [[a, b, c], [b, d, e], [c, e, f]] and return the determinant."""
    k00, k01, k02 = d * f - e * e, e * c - b * f, b * e - d * c
    det = a * k00 + b * k01 + c * k02
    K[0, 0], K[1, 1], K[2, 2] = k00 / det, (a * f - c * c) / det, (a * d - b * b) / det
    K[0, 1] = K[1, 0] = k01 / det
    K[0, 2] = K[2, 0] = k02 / det
    K[1, 2] = K[2, 1] = (b * c - a * e) / det
    return det


@njit(cache=True)
def add_moment(
    P: Array, g: Array, variance: float, P_with: Array, g_with: Array, K: Array, CK: Array
) -> tuple[float, float]:
    """Add an isotropic moment of this variance to Sigma in P = U^T Sigma^-1 U and g = U^T Sigma^-1 tau.

    With C the moment's columns of P and K = (P_mm + 1 / variance)^-1, P becomes P - C K C^T, and g becomes g - C K g_m.

    Returns:
        What it adds to log det Sigma, and what it takes from tau^T Sigma^-1 tau.
    """
    t = 1.0 / variance
    det = invert(P[3, 3] + t, P[3, 4], P[3, 5], P[4, 4] + t, P[4, 5], P[5, 5] + t, K)
    g0, g1, g2 = g[3], g[4], g[5]
    for r in range(6):
        for j in range(3):
            CK[r, j] = P[r, 3] * K[0, j] + P[r, 4] * K[1, j] + P[r, 5] * K[2, j]
        g_with[r] = g[r] - (CK[r, 0] * g0 + CK[r, 1] * g1 + CK[r, 2] * g2)
        for s in range(r + 1):
            P_with[r, s] = P[r, s] - (CK[r, 0] * P[s, 3] + CK[r, 1] * P[s, 4] + CK[r, 2] * P[s, 5])
            P_with[s, r] = P_with[r, s]
    explained = K[0, 0] * g0 * g0 + K[1, 1] * g1 * g1 + K[2, 2] * g2 * g2
    explained += 2.0 * (K[0, 1] * g0 * g1 + K[0, 2] * g0 * g2 + K[1, 2] * g1 * g2)
    return np.log(det * variance * variance * variance), explained


@njit(fastmath=_FAST, inline="always")  # LLVM alone leaves it a call, which doubles the time of a point
def _normal_equations(
    point: Array, P: Array, g: Array
) -> tuple[float, float, float, float, float, float, float, float, float]:
    """Return the six entries of G = A^T Sigma^-1 A and the three of c = A^T Sigma^-1 tau at a point."""
    x, y, z = point[0], point[1], point[2]
    # G = P_ff + E X + (E X)^T with X = [x] and E = P_fm + X^T P_mm / 2; c = g_f + g_m x x.
    E00 = P[0, 3] + 0.5 * (z * P[3, 4] - y * P[3, 5])
    E01 = P[0, 4] + 0.5 * (z * P[4, 4] - y * P[4, 5])
    E02 = P[0, 5] + 0.5 * (z * P[4, 5] - y * P[5, 5])
    E10 = P[1, 3] + 0.5 * (x * P[3, 5] - z * P[3, 3])
    E11 = P[1, 4] + 0.5 * (x * P[4, 5] - z * P[3, 4])
    E12 = P[1, 5] + 0.5 * (x * P[5, 5] - z * P[3, 5])
    E20 = P[2, 3] + 0.5 * (y * P[3, 3] - x * P[3, 4])
    E21 = P[2, 4] + 0.5 * (y * P[3, 4] - x * P[4, 4])
    E22 = P[2, 5] + 0.5 * (y * P[3, 5] - x * P[4, 5])
    return (
        P[0, 0] + 2.0 * (E01 * z - E02 * y),
        P[0, 1] + (E02 * x - E00 * z) + (E11 * z - E12 * y),
        P[0, 2] + (E00 * y - E01 * x) + (E21 * z - E22 * y),
        P[1, 1] + 2.0 * (E12 * x - E10 * z),
        P[1, 2] + (E10 * y - E11 * x) + (E22 * x - E20 * z),
        P[2, 2] + 2.0 * (E20 * y - E21 * x),
        g[0] + g[4] * z - g[5] * y,
        g[1] + g[5] * x - g[3] * z,
        g[2] + g[3] * y - g[4] * x,
    )


@njit(fastmath=_FAST, cache=True)
def score(point: Array, P: Array, g: Array, m: float, normal: float, tangential: float) -> tuple[float, float]:
    """Return what a point adds to -2 log p: to the exponent, and det(S (S^-1 + G)).

    Args:
        point: (6,) position and inward normal, in the link's frame.
        P: (6, 6) U^T Sigma^-1 U.
        g: (6,) U^T Sigma^-1 tau.
        m: mean of the normal force [N].
        normal: its variance [N^2].
        tangential: variance of each tangential component [N^2].
    """
    G00, G01, G02, G11, G12, G22, c0, c1, c2 = _normal_equations(point, P, g)
    u0, u1, u2 = point[3], point[4], point[5]
    k0, k1, k2 = G00 * u0 + G01 * u1 + G02 * u2, G01 * u0 + G11 * u1 + G12 * u2, G02 * u0 + G12 * u1 + G22 * u2
    b0, b1, b2 = c0 - m * k0, c1 - m * k1, c2 - m * k2
    # H = S^-1 + G with S^-1 = 1 / tangential + (1 / normal - 1 / tangential) u u^T.
    t = 1.0 / tangential
    d = 1.0 / normal - t
    h00, h01, h02 = t + d * u0 * u0 + G00, d * u0 * u1 + G01, d * u0 * u2 + G02
    h11, h12, h22 = t + d * u1 * u1 + G11, d * u1 * u2 + G12, t + d * u2 * u2 + G22
    a00, a01, a02 = h11 * h22 - h12 * h12, h12 * h02 - h01 * h22, h01 * h12 - h11 * h02
    a11, a12, a22 = h00 * h22 - h02 * h02, h01 * h02 - h00 * h12, h00 * h11 - h01 * h01
    det = h00 * a00 + h01 * a01 + h02 * a02
    explained = b0 * (a00 * b0 + 2.0 * (a01 * b1 + a02 * b2)) + b1 * (a11 * b1 + 2.0 * a12 * b2) + a22 * b2 * b2
    exponent = m * (m * (k0 * u0 + k1 * u1 + k2 * u2) - 2.0 * (c0 * u0 + c1 * u1 + c2 * u2)) - explained / det
    return exponent, det * normal * tangential * tangential


@njit(cache=True)
def force(point: Array, P: Array, g: Array, m: float, normal: float, tangential: float, f: Array, K: Array) -> None:
    """Set f (3,) [N] and K (3, 3) [N^2] to the posterior mean and covariance of the force at a point; see `score`."""
    G00, G01, G02, G11, G12, G22, c0, c1, c2 = _normal_equations(point, P, g)
    u0, u1, u2 = point[3], point[4], point[5]
    t = 1.0 / tangential
    d = 1.0 / normal - t
    invert(
        t + d * u0 * u0 + G00,
        d * u0 * u1 + G01,
        d * u0 * u2 + G02,
        t + d * u1 * u1 + G11,
        d * u1 * u2 + G12,
        t + d * u2 * u2 + G22,
        K,
    )
    # (S^-1 + G)^-1 (c + S^-1 m u)
    s = m / normal
    for r in range(3):
        f[r] = K[r, 0] * (c0 + s * u0) + K[r, 1] * (c1 + s * u1) + K[r, 2] * (c2 + s * u2)
