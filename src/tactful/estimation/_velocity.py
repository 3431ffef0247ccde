"""The joint velocity that the observer differentiates, and the clock that it integrates by."""

from __future__ import annotations

import functools
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

Vector = NDArray[np.float64]

MAX_WINDOW = 32
"""Longest window of the slope [samples]."""
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
            ("window", "i8"),  # of the slope [samples]; 0: the measured velocity
            ("clock", "f8"),  # period of the robot's clock [s]; 0: the stamps count
            ("count", "i8"),  # samples since the start
            ("behind", "f8"),  # how far the robot's clock is behind the stamps [s]
            ("t", "f8"),  # since the start [s]
            ("q", "f8", (n,)),  # of the sample before
            ("dq", "f8", (n,)),  # of the sample before
            ("past_q", "f8", (MAX_WINDOW + 1, n)),
            ("past_t", "f8", (MAX_WINDOW + 1,)),
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

    With a window of m samples, v_k = (q_k - q_(k-m)) / (t_k - t_(k-m)).
    """
    if restart:
        state.count, state.behind, state.t = 0, 0.0, 0.0
    elif state.clock > 0.0:
        dt = _elapsed(state, dt, q, dq)
        if dt == 0.0:
            return 0.0
    state.q[:] = q
    state.dq[:] = dq
    if state.window == 0:
        state.v[:] = dq
        return dt
    if not restart:
        state.t += dt
    length = state.window + 1
    slot = state.count % length
    state.past_q[slot] = q
    state.past_t[slot] = state.t
    state.count += 1
    oldest = state.count % length if state.count >= length else 0
    span = state.t - state.past_t[oldest]
    for i in range(q.shape[0]):
        state.v[i] = (q[i] - state.past_q[oldest, i]) / span if span > 0.0 else dq[i]
    return dt


@njit(cache=True)
def settled(state: Any) -> bool:
    """Whether the window of the slope is full."""
    return state.count > state.window or state.window == 0  # type: ignore[no-any-return]
