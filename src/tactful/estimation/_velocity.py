"""The joint velocity that the observer differentiates, and the clock that it integrates by."""

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
_MOVING_RAD_S = 0.05
"""Speed over all joints from which position and velocity tell the time between two samples [rad/s]."""
_SLACK = 6.0
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
            ("past_q", "f8", (_RING, n)),
            ("past_t", "f8", (_RING,)),
            ("v", "f8", (n,)),  # the velocity
        ],
        align=True,
    )


@njit(cache=True)
def _elapsed(state: Any, dt: float, q: Vector, dq: Vector) -> float:
    """Return the time that the robot's clock counted since the sample before, 0 for a sample that is still the same.

    Each step of the robot is a whole number of its periods. While the arm moves, dx . v / |v|^2 tells which.
    """
    waited = state.behind + dt
    along, speed = 0.0, 0.0
    for i in range(q.shape[0]):
        v = 0.5 * (dq[i] + state.dq[i])
        along += (q[i] - state.q[i]) * v
        speed += v * v
    periods = max(1.0, np.round(waited / state.clock))
    if speed > _MOVING_RAD_S * _MOVING_RAD_S:
        told = max(0.0, np.round(along / speed / state.clock))
        if abs(waited / state.clock - told) < _SLACK:
            periods = told
    state.behind = waited - periods * state.clock
    if periods > 0.0:
        state.behind *= 1.0 - _FORGET
    return periods * state.clock  # type: ignore[no-any-return]


@njit(cache=True)
def sense(state: Any, restart: bool, dt: float, q: Vector, dq: Vector) -> float:
    """Set the velocity v and return the time since the sample before [s], 0 for a sample that came twice.

    With a window W, v(t) = (q(t) - q(t - W)) / W, where q is linear between two samples: a window of whole samples
    would change its length, and v its lag, at every hole.
    """
    if restart:
        state.count, state.behind, state.t = 0, 0.0, 0.0
    elif state.clock > 0.0:
        dt = _elapsed(state, dt, q, dq)
        if dt == 0.0:
            return 0.0
    copy(q, state.q)
    copy(dq, state.dq)
    if state.window == 0.0:
        copy(dq, state.v)
        return dt
    if not restart:
        state.t += dt
    copy(q, state.past_q[state.count % _RING])
    state.past_t[state.count % _RING] = state.t
    state.count += 1
    begin = state.t - state.window
    k = state.count - 1  # the last sample that is not after the beginning, or the oldest
    while k > 0 and k > state.count - _RING and state.past_t[k % _RING] > begin:
        k -= 1
    older, newer = k % _RING, (k + 1) % _RING
    begin = max(begin, state.past_t[older])
    if k == state.count - 1 or begin >= state.t:
        copy(dq, state.v)
        return dt
    share = (begin - state.past_t[older]) / (state.past_t[newer] - state.past_t[older])
    for i in range(q.shape[0]):
        then = (1.0 - share) * state.past_q[older, i] + share * state.past_q[newer, i]
        state.v[i] = (q[i] - then) / (state.t - begin)
    return dt


@njit(cache=True)
def settled(state: Any) -> bool:
    """Whether the window of the slope is full."""
    return state.window == 0.0 or state.t >= state.window  # type: ignore[no-any-return]
