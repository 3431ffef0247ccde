"""Kernels of an arm with elastic joints, after (1) of the aim-aware paper."""

from __future__ import annotations

import functools
import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tactful._njit import njit
from tactful.dynamics import kernels
from tactful.dynamics._linear import solve_positive
from tactful.impacts import contact_force

Array = NDArray[np.float64]


@functools.cache
def elastic_dtype(n: int, points: int) -> np.dtype[np.void]:
    """Return the layout of the elastic joints and the contacts of an arm with n joints."""
    joints = ("f8", (n,))
    return np.dtype(
        [
            ("K", *joints),
            ("D", *joints),
            ("B", *joints),
            ("viscous", *joints),
            ("coulomb", *joints),
            ("coulomb_speed", "f8"),  # speed of a motor at which it has 76 % of its Coulomb friction [rad/s]
            ("link", "i8", (points,)),
            ("point", "f8", (points, 3)),  # in the link's frame [m]
            ("surface", "f8", (3,)),  # a point of the plane, in the base [m]
            ("normal", "f8", (3,)),
            ("k", "f8"),
            ("p", "f8"),
            ("d", "f8"),
            ("mu", "f8"),
            ("v_s", "f8"),
            ("state", "f8", (4 * n,)),  # q, dq, theta, dtheta
            ("trial", "f8", (4 * n,)),
            ("slope", "f8", (4, 4 * n)),
            ("q", *joints),
            ("dq", *joints),
            ("zero", *joints),
            ("bias", *joints),
            ("tau_ext", *joints),
            ("force", "f8", (points, 3)),  # on the robot, in the base [N]
            ("gap", "f8", (points,)),  # [m]
            ("x", "f8", (3,)),
            ("J", "f8", (6, n)),
            ("M", "f8", (n, n)),
        ],
        align=True,
    )


@njit(cache=True)
def contacts(arm: Any, motion: Any, elastic: Any) -> None:
    """Set gaps, forces and tau_ext at q and dq of `elastic`, after `place`."""
    n = elastic.q.shape[0]
    for i in range(n):
        elastic.tau_ext[i] = 0.0
    for c in range(elastic.link.shape[0]):
        link, x, J, F, normal = elastic.link[c], elastic.x, elastic.J, elastic.force[c], elastic.normal
        gap = 0.0
        for r in range(3):
            x[r] = motion.o[link, r]
            for s in range(3):
                x[r] += motion.R[link, r, s] * elastic.point[c, s]
            gap += (x[r] - elastic.surface[r]) * normal[r]
            F[r] = 0.0
        elastic.gap[c] = gap
        if gap >= 0.0:
            continue
        kernels.jacobian(arm, motion, link, x, J)
        closing = 0.0
        for r in range(3):
            for i in range(n):
                F[r] += J[r, i] * elastic.dq[i]  # the velocity, for now
            closing -= F[r] * normal[r]
        sliding = 0.0
        for r in range(3):
            F[r] += closing * normal[r]
            sliding += F[r] * F[r]
        sliding = math.sqrt(sliding)
        pressed = contact_force(elastic.k, elastic.p, elastic.d, -gap, closing)
        share = elastic.mu * pressed * math.tanh(sliding / elastic.v_s) / sliding if sliding > 0.0 else 0.0
        for r in range(3):
            F[r] = pressed * normal[r] - share * F[r]
            for i in range(n):
                elastic.tau_ext[i] += J[r, i] * F[r]


@njit(cache=True)
def derivative(arm: Any, motion: Any, elastic: Any, u: Array, state: Array, slope: Array) -> None:
    """Set slope = d state / dt under the torques u (n,) of the motors."""
    n = u.shape[0]
    for i in range(n):
        elastic.q[i], elastic.dq[i] = state[i], state[n + i]
    kernels.place(arm, motion, elastic.q)
    kernels.inverse_dynamics(arm, motion, elastic.dq, elastic.zero, elastic.bias)
    kernels.mass_matrix(arm, motion, elastic.M)
    contacts(arm, motion, elastic)
    for i in range(n):
        rate = state[3 * n + i]
        tau = elastic.K[i] * (state[2 * n + i] - state[i]) + elastic.D[i] * (rate - state[n + i])
        friction = elastic.viscous[i] * rate + elastic.coulomb[i] * math.tanh(rate / elastic.coulomb_speed)
        slope[i], slope[2 * n + i] = state[n + i], rate
        slope[3 * n + i] = (u[i] - tau - friction) / elastic.B[i]
        elastic.bias[i] = tau + elastic.tau_ext[i] - elastic.bias[i]
    solve_positive(elastic.M, elastic.bias)
    for i in range(n):
        slope[n + i] = elastic.bias[i]


@njit(cache=True)
def advance(arm: Any, motion: Any, elastic: Any, u: Array, h: float, steps: int) -> None:
    """Take steps h [s] of the classical Runge-Kutta method under constant torques u (n,) of the motors."""
    size = elastic.state.shape[0]
    x, trial, k = elastic.state, elastic.trial, elastic.slope
    for _ in range(steps):
        derivative(arm, motion, elastic, u, x, k[0])
        for stage in range(1, 4):
            share = h if stage == 3 else 0.5 * h
            for i in range(size):
                trial[i] = x[i] + share * k[stage - 1, i]
            derivative(arm, motion, elastic, u, trial, k[stage])
        for i in range(size):
            x[i] += h / 6.0 * (k[0, i] + 2.0 * k[1, i] + 2.0 * k[2, i] + k[3, i])
    derivative(arm, motion, elastic, u, x, k[0])  # leaves forces and tau_ext of the end
