"""The joint velocity that the observer differentiates, position and torque of the same moment, and its clock."""

from __future__ import annotations

import functools
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tactful._njit import njit
from tactful.dynamics.kernels import copy

Vector = NDArray[np.float64]

_RING = 64
"""Samples that are kept: a window that is longer becomes so long."""
_MOVING_RAD_S = 0.1
"""Speed over all joints from which position and velocity tell the time between two samples [rad/s]."""
_CREEPING_RAD_S = 0.01
"""Speed from which the arm creeps: a sample like the one before is that one once more [rad/s]."""
_SLACK, _CREEPING_SLACK = 6.0, 2.0
"""How far the time that position and velocity tell may be from the stamps' [periods of the clock]."""
_FORGET = 1e-3
"""Share of the difference between the clocks that each sample forgets: they need not run at the same speed."""


@functools.cache
def velocity_dtype(n: int) -> np.dtype[np.void]:
    """Return the layout of the settings and the state of the velocity for n joints."""
    return np.dtype(
        [
            ("window", "f8"),  # of the slope [s]; 0: the measured velocity
            ("clock", "f8"),  # period of the robot's clock [s]; 0: the stamps count
            ("count", "i8"),  # samples since the start
            ("behind", "f8"),  # how far the robot's clock is behind the stamps [s]
            ("t", "f8"),  # since the start [s]
            ("q", "f8", (n,)),  # of the sample before
            ("dq", "f8", (n,)),  # of the sample before
            ("tau", "f8", (n,)),  # of the sample before
            ("impulse", "f8", (n,)),  # integral of the torque since the start [Nms]
            ("past_q", "f8", (_RING, n)),
            ("past_impulse", "f8", (_RING, n)),
            ("past_t", "f8", (_RING,)),
            ("v", "f8", (n,)),  # the velocity
            ("q_v", "f8", (n,)),  # the position that goes with it
            ("tau_v", "f8", (n,)),  # the torque that goes with it
        ],
        align=True,
    )


@njit(cache=True)
def _elapsed(state: Any, dt: float, q: Vector, dq: Vector) -> float:
    """Return the time that the robot's clock counted since the sample before, 0 for a sample that is still the same.

    Each step of the robot is a whole number of its periods. While the arm moves, dx . v / |v|^2 tells which. While it
    creeps, the measured v is too noisy for that: its slope until now tells, and only a sample that came twice is none.
    """
    waited = state.behind + dt
    along = speed = creeping_along = creeping = 0.0
    same = True
    for i in range(q.shape[0]):
        dx, v = q[i] - state.q[i], 0.5 * (dq[i] + state.dq[i])
        along += dx * v
        speed += v * v
        creeping_along += dx * state.v[i]
        creeping += state.v[i] * state.v[i]
        same = same and dx == 0.0 and dq[i] == state.dq[i]
    periods = max(1.0, np.round(waited / state.clock))
    told, slack = periods, _SLACK
    if same and speed > _CREEPING_RAD_S * _CREEPING_RAD_S:
        told = 0.0
    elif speed > _MOVING_RAD_S * _MOVING_RAD_S:
        told = max(0.0, np.round(along / speed / state.clock))
    elif state.window > 0.0 and creeping > _CREEPING_RAD_S * _CREEPING_RAD_S:
        told, slack = max(1.0, np.round(creeping_along / creeping / state.clock)), _CREEPING_SLACK
    if abs(waited / state.clock - told) < slack:
        periods = told
    state.behind = waited - periods * state.clock
    if periods > 0.0:
        state.behind *= 1.0 - _FORGET
    return periods * state.clock  # type: ignore[no-any-return]


@njit(cache=True)
def sense(state: Any, restart: bool, dt: float, q: Vector, dq: Vector, tau: Vector) -> float:
    """Set velocity, position and torque, and return the time since the sample before [s], 0 for one that came twice.

    With a window W, v(t) = (q(t) - q(t - W)) / W, where q is linear between two samples: a window of whole samples
    would change its length, and v its lag, at every hole. v is the mean velocity of the window, so the position is that
    of its middle, and the torque its mean: one that is half a window ahead of v looks like a contact in each jerk.
    """
    if restart:
        state.count, state.behind, state.t = 0, 0.0, 0.0
        state.impulse[:] = 0.0
    elif state.clock > 0.0:
        dt = _elapsed(state, dt, q, dq)
        if dt == 0.0:
            return 0.0
    copy(q, state.q)
    copy(dq, state.dq)
    copy(dq, state.v)
    copy(q, state.q_v)
    copy(tau, state.tau_v)
    if state.window == 0.0:
        return dt
    if not restart:
        state.t += dt
        for i in range(q.shape[0]):
            state.impulse[i] += 0.5 * dt * (state.tau[i] + tau[i])
    copy(tau, state.tau)
    copy(q, state.past_q[state.count % _RING])
    copy(state.impulse, state.past_impulse[state.count % _RING])
    state.past_t[state.count % _RING] = state.t
    state.count += 1
    begin = state.t - state.window
    k = state.count - 1  # the last sample that is not after the beginning, or the oldest
    while k > 0 and k > state.count - _RING and state.past_t[k % _RING] > begin:
        k -= 1
    older, newer = k % _RING, (k + 1) % _RING
    begin = max(begin, state.past_t[older])
    if k == state.count - 1 or begin >= state.t:
        return dt
    share = (begin - state.past_t[older]) / (state.past_t[newer] - state.past_t[older])
    for i in range(q.shape[0]):
        then = (1.0 - share) * state.past_q[older, i] + share * state.past_q[newer, i]
        state.v[i] = (q[i] - then) / (state.t - begin)
        state.q_v[i] = 0.5 * (q[i] + then)
        then = (1.0 - share) * state.past_impulse[older, i] + share * state.past_impulse[newer, i]
        state.tau_v[i] = (state.impulse[i] - then) / (state.t - begin)
    return dt


@njit(cache=True)
def settled(state: Any) -> bool:
    """Whether the window of the slope is full."""
    return state.window == 0.0 or state.t >= state.window  # type: ignore[no-any-return]
