"""Kernels of the planar arm with elastic joints, in the absolute angles of its links."""

from __future__ import annotations

import functools
import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tactful._njit import njit
from tactful.impacts import contact_force, friction_force
from tactful.simulation.planar._config import PlanarConfig

Array = NDArray[np.float64]
Record = np.ndarray[tuple[int], np.dtype[np.void]]

STATE = 14
"""Absolute angles of the links, their rates, positions of the motors, their rates, three each; how far the surface has
given way along its normal, and its rate."""
_AWAY = 1e9
"""Gap of a point that has nothing before it [m]."""


@functools.cache
def plant_dtype(points: int) -> np.dtype[np.void]:
    """Return the layout of an arm with `points` contact points, its surface, and scratch."""
    three = ("f8", (3,))
    return np.dtype(
        [
            ("length", *three),
            ("A", "f8", (3, 3)),  # M_jk = A_jk cos(phi_j - phi_k)
            ("G", *three),  # g_j = G_j cos(phi_j)
            ("K", *three),
            ("D", *three),
            ("B", *three),  # B_theta
            ("coulomb", *three),
            ("viscous", *three),
            ("offset", "f8", (points,)),  # of the contact points along the face [m]
            ("k", "f8"),
            ("p", "f8"),
            ("d", "f8"),
            ("mu", "f8"),
            ("lightest", "f8"),  # effective mass that a contact point has at least [kg]
            ("v_s", "f8"),  # sliding speed of the regularized friction [m/s]
            ("surface", "f8", (2,)),  # a point of it
            ("normal", "f8", (2,)),
            ("reach", "f8", (2,)),  # where it begins and ends, along (n_y, -n_x) [m]
            ("yielding", "f8"),  # one over the mass of its object; 0: fixed [1/kg]
            ("support_k", "f8"),
            ("support_d", "f8"),
            ("cos", *three),
            ("sin", *three),
            ("M", "f8", (3, 3)),
            ("bias", *three),
            ("Q", *three),
            # of the contact points, then of the two ends of the surface against the face
            ("gap", "f8", (points + 2,)),  # negative: penetration [m]
            ("closing", "f8", (points + 2,)),  # -d gap / dt [m/s]
            ("F_n", "f8", (points + 2,)),  # [N]
            ("F_t", "f8", (points + 2,)),
            ("load", "f8"),  # on the surface, against its normal [N]
            ("state", "f8", (STATE,)),
            ("trial", "f8", (STATE,)),
            ("slope", "f8", (4, STATE)),
        ],
        align=True,
    )


MOTOR_FRICTION_SPEED_RAD_S = 0.01
"""Speed of a motor at which its Coulomb friction has 76 % of its value."""


def plant_record(config: PlanarConfig) -> Record:
    """Return the arm on the horizontal surface; `surface` and `normal` are to be set for each case."""
    arm = config.arm
    record: Any = np.zeros(1, plant_dtype(len(arm.offsets_m)))
    plant = record[0]
    length, mass = np.array(arm.length_m), np.array(arm.mass_kg)
    # Lever of link i's centre of mass on the angle of link j: whole links before it, half of itself.
    lever = np.tril(np.broadcast_to(length, (3, 3)), -1) + np.diag(length / 2)  # (i, j)
    plant["length"] = length
    plant["A"] = np.einsum("i,ij,ik->jk", mass, lever, lever) + np.diag(mass * length**2 / 12)
    plant["G"] = arm.gravity_m_s2 * mass @ lever
    plant["K"], plant["D"], plant["B"] = arm.stiffness_nm_rad, arm.damping_nms_rad, arm.motor_inertia
    plant["coulomb"], plant["viscous"] = arm.coulomb_nm, arm.viscous_nms
    plant["offset"] = arm.offsets_m
    contact = config.contact
    plant["k"], plant["p"], plant["d"] = contact.stiffness, contact.exponent, contact.damping_s_m
    plant["mu"], plant["v_s"] = contact.friction, contact.friction_speed_m_s
    reach = max(offset**2 for offset in arm.offsets_m) + (length[2] / 2) ** 2
    surface = config.surface
    plant["yielding"] = 0.0 if surface.mass_kg is None else 1 / surface.mass_kg
    plant["lightest"] = 1 / ((1 + reach / (length[2] ** 2 / 12)) / mass[2] + plant["yielding"])
    plant["normal"], plant["reach"] = (0.0, 1.0), surface.reach_m
    plant["support_k"], plant["support_d"] = surface.support_n_m, surface.support_ns_m
    return record  # type: ignore[no-any-return]


@njit(cache=True)
def inertia(plant: Any, state: Array) -> None:
    """Set cos, sin, M and the bias of Coriolis and gravity, all for absolute angles."""
    for i in range(3):
        plant.cos[i], plant.sin[i] = math.cos(state[i]), math.sin(state[i])
    for i in range(3):
        total = plant.G[i] * plant.cos[i]
        for j in range(3):
            plant.M[i, j] = plant.A[i, j] * (plant.cos[i] * plant.cos[j] + plant.sin[i] * plant.sin[j])
            total += (
                plant.A[i, j]
                * (plant.sin[i] * plant.cos[j] - plant.cos[i] * plant.sin[j])
                * state[3 + j]
                * state[3 + j]
            )
        plant.bias[i] = total


@njit(cache=True)
def contacts(plant: Any, state: Array) -> None:
    """Set gaps, closing speeds and forces, add the forces to Q and to the load of the surface, after `inertia`."""
    x, y, dx, dy = -plant.surface[0], -plant.surface[1], 0.0, 0.0  # of the tip, against the surface's point at rest
    for i in range(3):
        x += plant.length[i] * plant.cos[i]
        y += plant.length[i] * plant.sin[i]
        dx -= plant.length[i] * plant.sin[i] * state[3 + i]
        dy += plant.length[i] * plant.cos[i] * state[3 + i]
    n_x, n_y = plant.normal[0], plant.normal[1]
    x, y = x - n_x * state[12], y - n_y * state[12]
    dx, dy = dx - n_x * state[13], dy - n_y * state[13]
    u_x, u_y = plant.cos[2], plant.sin[2]  # out of the face, which lies along (-u_y, u_x)
    plant.load = 0.0
    points = plant.offset.shape[0]
    for c in range(points):
        s = plant.offset[c]
        p_x, p_y = x - s * u_y, y + s * u_x
        along = p_x * n_y - p_y * n_x
        plant.gap[c] = p_x * n_x + p_y * n_y if plant.reach[0] <= along <= plant.reach[1] else _AWAY
        _touch(plant, state, c, s, dx - s * u_x * state[5], dy - s * u_y * state[5], n_x, n_y)
    half = plant.offset[points - 1]
    for end in range(2):
        plant.gap[points + end], s = _AWAY, 0.0
        if math.isfinite(plant.reach[end]):
            d_x, d_y = plant.reach[end] * n_y - x, -plant.reach[end] * n_x - y
            s = d_y * u_x - d_x * u_y
            if abs(s) < half:
                plant.gap[points + end] = d_x * u_x + d_y * u_y
        _touch(plant, state, points + end, s, dx - s * u_x * state[5], dy - s * u_y * state[5], -u_x, -u_y)


@njit(cache=True)
def _touch(plant: Any, state: Array, c: int, s: float, v_x: float, v_y: float, n_x: float, n_y: float) -> None:
    """Let contact c act at s along the face, where the velocity against the surface is v, along the normal n."""
    plant.closing[c] = -(v_x * n_x + v_y * n_y) if plant.gap[c] < _AWAY else 0.0
    plant.F_n[c] = plant.F_t[c] = 0.0
    if plant.gap[c] >= 0.0:
        return
    F_n = contact_force(plant.k, plant.p, plant.d, -plant.gap[c], plant.closing[c])
    F_t = friction_force(plant.mu, plant.v_s, F_n, v_x * n_y - v_y * n_x)
    plant.F_n[c], plant.F_t[c] = F_n, F_t
    f_x, f_y = F_n * n_x + F_t * n_y, F_n * n_y - F_t * n_x
    plant.load += f_x * plant.normal[0] + f_y * plant.normal[1]
    for i in range(3):
        plant.Q[i] += plant.length[i] * (f_y * plant.cos[i] - f_x * plant.sin[i])
    plant.Q[2] -= s * (f_x * plant.cos[2] + f_y * plant.sin[2])


@njit(cache=True)
def solve_three(M: Array, b: Array, x: Array) -> None:
    """Set x = M^-1 b for a symmetric M (3, 3)."""
    c0 = M[1, 1] * M[2, 2] - M[1, 2] * M[1, 2]
    c1 = M[0, 2] * M[1, 2] - M[0, 1] * M[2, 2]
    c2 = M[0, 1] * M[1, 2] - M[0, 2] * M[1, 1]
    c3 = M[0, 0] * M[2, 2] - M[0, 2] * M[0, 2]
    c4 = M[0, 1] * M[0, 2] - M[0, 0] * M[1, 2]
    c5 = M[0, 0] * M[1, 1] - M[0, 1] * M[0, 1]
    scale = 1.0 / (M[0, 0] * c0 + M[0, 1] * c1 + M[0, 2] * c2)
    b0, b1, b2 = b[0], b[1], b[2]
    x[0] = scale * (c0 * b0 + c1 * b1 + c2 * b2)
    x[1] = scale * (c1 * b0 + c3 * b1 + c4 * b2)
    x[2] = scale * (c2 * b0 + c4 * b1 + c5 * b2)


@njit(cache=True)
def joint_torque(plant: Any, state: Array, i: int) -> tuple[float, float]:
    """Return the spring's torque tau_J of joint i and what the damper D K^-1 dtau_J/dt adds to it [Nm]."""
    q, dq = state[i], state[3 + i]
    if i > 0:
        q -= state[i - 1]
        dq -= state[2 + i]
    return plant.K[i] * (state[6 + i] - q), plant.D[i] * (state[9 + i] - dq)


@njit(cache=True)
def derivative(plant: Any, u: Array, state: Array, slope: Array) -> None:
    """Set slope = d state / dt under the commanded torque u (3,), (1) of the paper."""
    inertia(plant, state)
    above = 0.0
    for i in range(2, -1, -1):
        spring, damper = joint_torque(plant, state, i)
        tau = spring + damper
        plant.Q[i] = tau - above - plant.bias[i]
        above = tau
        rate = state[9 + i]
        friction = plant.viscous[i] * rate
        if plant.coulomb[i] > 0.0:
            friction += plant.coulomb[i] * math.tanh(rate / MOTOR_FRICTION_SPEED_RAD_S)
        slope[9 + i] = (u[i] - tau - friction) / plant.B[i]
        slope[6 + i] = rate
        slope[i] = state[3 + i]
    contacts(plant, state)
    solve_three(plant.M, plant.Q, slope[3:6])
    slope[12] = state[13]
    slope[13] = -plant.yielding * (plant.load + plant.support_k * state[12] + plant.support_d * state[13])


@njit(cache=True)
def safe_step(plant: Any, coarse: float, fine: float) -> float:
    """Return the step [s] that the contacts allow, after `derivative` at the state: the fine one near or in contact.

    In contact, the rate at which damping and friction brake a point, times the step, stays well inside the region of
    stability; the lightest that a point can be is the last link, free.
    """
    nearest, fastest, hardest = 1e9, 0.0, 0.0
    for c in range(plant.gap.shape[0]):
        nearest = min(nearest, plant.gap[c])
        fastest = max(fastest, abs(plant.closing[c]))
        if plant.gap[c] < 0.0:
            spring = contact_force(plant.k, plant.p, 0.0, -plant.gap[c], 0.0)
            hardest = max(hardest, spring * plant.d + plant.mu * plant.F_n[c] / plant.v_s)
    if nearest > 2.0 * coarse * fastest + 1e-6:
        return coarse
    braking = hardest / plant.lightest  # [1/s]
    return 1.5 / braking if fine * braking > 1.5 else fine


@njit(cache=True)
def step(plant: Any, u: Array, left: float, coarse: float, fine: float) -> float:
    """Take one step of the classical Runge-Kutta method, not beyond the time that is left; return its length [s].

    `gap` and `closing` are then those of its beginning, or close to its end.
    """
    x, trial, k = plant.state, plant.trial, plant.slope
    derivative(plant, u, x, k[0])
    h = left / math.ceil(left / safe_step(plant, coarse, fine) - 1e-9)
    for stage in range(1, 4):
        share = h if stage == 3 else 0.5 * h
        for i in range(STATE):
            trial[i] = x[i] + share * k[stage - 1, i]
        derivative(plant, u, trial, k[stage])
    for i in range(STATE):
        x[i] += h / 6.0 * (k[0, i] + 2.0 * k[1, i] + 2.0 * k[2, i] + k[3, i])
    return h  # type: ignore[no-any-return]
