"""The per-sample work of the monitor: one function on preallocated records, for one sample and for many."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from tactful._njit import njit
from tactful.detection import _glr
from tactful.detection.contact_state import (
    COLLISION,
    COOPERATION,
    DETECTED,
    ENDED,
    FREE,
    NEW_DIRECTION,
    NOTHING,
    advance,
    clear,
)
from tactful.dynamics import kernels
from tactful.dynamics.kernels import copy
from tactful.estimation._momentum_observer import observe_motion
from tactful.estimation._wrench import solve_wrench
from tactful.signals import _sliding_dft

Array = NDArray[np.float64]

TAU, TAU_EXT, WRENCH = range(3)
"""Sources of the force."""

_MOVING_RAD_S = 0.01
_ABSURD = 1e9
"""Magnitude from which on no value comes from a sensor; one would outlast every window."""

SKIPPED, RESTARTED, LOCATE = 10, 11, 12
"""What a sample may bring beyond what `contact_state` names: it was bad, time jumped while there was a contact, or it
is time to look where the contact is."""

_QUIET = 0.5
"""Share of the threshold below which nothing suggests a contact."""


@njit(cache=True)
def _finite(sample: Any) -> bool:
    if not np.isfinite(sample.t):
        return False
    for i in range(sample.q.shape[0]):
        if not (abs(sample.q[i]) < _ABSURD and abs(sample.dq[i]) < _ABSURD and abs(sample.tau[i]) < _ABSURD):
            return False
    for i in range(6):  # noqa: SIM110 (numba compiles the loop without an allocation)
        if not abs(sample.wrench[i]) < _ABSURD:
            return False
    return True


@njit(cache=True)
def _same(a: Any, b: Any) -> bool:
    for i in range(a.q.shape[0]):
        if a.q[i] != b.q[i] or a.dq[i] != b.dq[i] or a.tau[i] != b.tau[i]:
            return False
    for i in range(6):  # noqa: SIM110 (see above)
        if a.wrench[i] != b.wrench[i]:
            return False
    return True


@njit(cache=True)
def _moves(sample: Any) -> bool:
    """Whether the arm moves, so that a sample like the one before is that one once more."""
    for i in range(sample.dq.shape[0]):  # noqa: SIM110 (see above)
        if abs(sample.dq[i]) > _MOVING_RAD_S:
            return True
    return False


@njit(cache=True)
def _estimate(memory: Any, sample: Any, row: Any, dt: float) -> float:
    """Estimate torque, wrench and twist into the row; return the time that the sample stands for, 0 for none [s]."""
    copy(sample.q, row.q)
    for i in range(row.tau_ext.shape[0]):
        row.tau_ext[i] = sample.tau[i] - memory.bias[i] if sample.source == TAU_EXT else sample.tau[i]
    for i in range(6):
        row.wrench[i] = sample.wrench[i] - memory.bias[i] if sample.source == WRENCH else sample.wrench[i]
    row.twist[:] = 0.0
    if not sample.has_q:
        return dt
    arm, motion, J = memory.arm, memory.motion, memory.J
    if sample.source == TAU:
        dt = observe_motion(arm, motion, memory.observer, dt, sample.q, sample.dq, sample.tau)
        copy(memory.observer.r, row.tau_ext)
    else:
        kernels.place(arm, motion, sample.q)
    kernels.tip_position(arm, motion, memory.x)
    kernels.jacobian(arm, motion, arm.tip_link, memory.x, J)
    if sample.has_dq:
        for r in range(6):
            for i in range(J.shape[1]):
                row.twist[r] += J[r, i] * sample.dq[i]
    if sample.source == WRENCH:
        return dt
    solve_wrench(memory.wrench, J, row.tau_ext)
    copy(memory.wrench.F, row.wrench)
    return dt


@njit(cache=True)
def _detect_fast(memory: Any, sample: Any, row: Any, dt: float) -> None:
    """Set the level and the slow signal of a sample that stands for the time dt."""
    glr = memory.glr
    if memory.contact.state == COLLISION:
        _glr.follow(glr, memory.slow, memory.contact.before)
    elif glr.has_known:
        glr.has_known = 0
        glr.known[:] = 0.0
    gain = memory.slow_gain if glr.started else 1.0
    for i in range(glr.x.shape[0]):
        glr.x[i] = row.wrench[i] if sample.source == WRENCH else row.tau_ext[i]
        memory.slow[i] += gain * (glr.x[i] - memory.slow[i])
        row.signal[i] = memory.slow[i]
    if sample.source == TAU:
        if memory.period > 0.0:
            dt = memory.period * max(1.0, np.round(dt / memory.period))
        _glr.take_momentum(glr, memory.arm, memory.motion, memory.observer, dt)
        _glr.step(glr, memory.observer.velocity.v, memory.contact.state != FREE)
    else:
        if glr.started == 0:
            copy(glr.x, glr.drift)
        _glr.step(glr, glr.still, memory.contact.state != FREE)
    row.level[0] = glr.level[0]
    if glr.learns and memory.contact.state == FREE:
        for i in range(memory.release.shape[0]):
            memory.contact.tolerance[i] = memory.release[i] * glr.scale
    if memory.contact.state == FREE and glr.level[0] < _QUIET:
        _follow_bias(memory, sample.source, row)


@njit(cache=True)
def _follow_bias(memory: Any, source: int, row: Any) -> None:
    """Take what is there while nothing suggests a contact for bias, slowly and within bounds."""
    for i in range(memory.bias.shape[0]):
        off = row.wrench[i] if source == WRENCH else row.tau_ext[i]
        limit = memory.bias_limit[i]
        bias = min(max(memory.bias[i] + memory.bias_gain * off, -limit), limit)
        if source == TAU:
            memory.observer.bias[i] -= bias - memory.bias[i]
        memory.bias[i] = bias


@njit(cache=True)
def _further(memory: Any, state: int) -> bool:
    """Return whether something further seems to touch the arm."""
    risen = memory.glr.risen
    return bool((state == COLLISION and risen[0]) or (state == COOPERATION and risen[1]))


@njit(cache=True)
def _settle(memory: Any, torque: Array) -> None:
    """Take the external torque of a sample into the slow one that tells where a contact is."""
    first, second = memory.where[0], memory.where[1]
    for i in range(torque.shape[0]):
        if memory.since_start == 0:
            first[i] = second[i] = torque[i]
        first[i] += memory.where_gain * (torque[i] - first[i])
        second[i] += memory.where_gain * (first[i] - second[i])


@njit(cache=True)
def _step(memory: Any, samples: Any, history: Any, dft: Any, twiddle: Array, window: Array, sums: Array) -> int:
    """Take samples[0] and return what it brings; samples[1] is the good sample before."""
    sample, before = samples[0], samples[1]
    memory.samples += 1
    if not _finite(sample):
        memory.nonfinite += 1
        memory.last_bad = memory.samples
        return SKIPPED
    contact = memory.contact
    code = NOTHING
    new = True
    dt = sample.t - memory.t
    if memory.since_start > 0:
        if dt <= 0.0:
            memory.backward += 1
            memory.last_bad = memory.samples
            return SKIPPED
        if dt > memory.gap:
            memory.gaps += 1
            memory.last_bad = memory.samples
            memory.since_start = 0
            memory.observer.started = 0
            memory.elapsed = 0.0
            _glr.restart(memory.glr)
            _sliding_dft.restart(dft, window, sums)
            if contact.state != FREE:
                code = RESTARTED
            clear(contact)
        elif _same(sample, before):
            memory.repeated += 1
            new = not _moves(sample)
    row = history[memory.written % history.shape[0]]
    stands_for = _estimate(memory, sample, row, dt)
    row.t = sample.t
    if memory.fast:
        memory.elapsed += stands_for
        row.level[:] = 0.0
        row.level[0] = memory.glr.level[0]
        copy(history[(memory.written - 1) % history.shape[0]].signal, row.signal)
        if memory.since_start == 0 or (new and stands_for > 0.0):
            _detect_fast(memory, sample, row, memory.elapsed)
            if sample.source != WRENCH:
                _settle(memory, memory.glr.x)
            memory.elapsed = 0.0
    else:
        copy(row.wrench, dft.x)
        _sliding_dft.step(dft, twiddle, window, sums)
        copy(dft.level, row.level)
        row.signal[:] = 0.0
        for i in range(3):
            row.signal[i] = row.wrench[i]
        if sample.source != WRENCH:
            _settle(memory, row.tau_ext)
    memory.t = sample.t
    memory.since_start += 1
    memory.written += 1
    if memory.since_start >= memory.warm_up:
        code = advance(contact, row.level, row.signal, row.wrench[:3])
        if code == NOTHING and memory.fast and contact.countdown == 0 and _further(memory, contact.state):
            contact.pending = 1
            code = NEW_DIRECTION
        if code == ENDED:
            _glr.resume(memory.glr, memory.slow, contact.back)
        elif code == DETECTED:
            memory.locate_in = memory.locate_every
        elif contact.state != FREE and memory.locate_every > 0:
            memory.locate_in -= 1
            if memory.locate_in <= 0 and code == NOTHING:
                memory.locate_in = memory.locate_every
                code = LOCATE
    row.state = contact.state
    copy(sample.q, before.q)
    copy(sample.dq, before.dq)
    copy(sample.tau, before.tau)
    copy(sample.wrench, before.wrench)
    return code


@njit(cache=True)
def update(record: Any, samples: Any, history: Any, dft: Any, twiddle: Array, window: Array, sums: Array) -> int:
    """Take samples[0] and return what it brings."""
    return _step(record[0], samples, history, dft[0], twiddle, window, sums)  # type: ignore[no-any-return]


@njit(cache=True)
def run(
    record: Any,
    samples: Any,
    history: Any,
    dft: Any,
    twiddle: Array,
    window: Array,
    sums: Array,
    t: Array,
    q: Array,
    dq: Array,
    tau: Array,
    wrench: Array,
    start: int,
    stop: int,
    trace: Any,
) -> tuple[int, int]:
    """Take the rows from `start` on until one brings something, and return the row after it and what it brings.

    Channels that are not there have no rows. `trace` has a row for every sample, or none.
    """
    memory, sample = record[0], samples[0]
    for k in range(start, stop):
        sample.t = t[k]
        if q.shape[0]:
            copy(q[k], sample.q)
        if dq.shape[0]:
            copy(dq[k], sample.dq)
        if tau.shape[0]:
            copy(tau[k], sample.tau)
        if wrench.shape[0]:
            copy(wrench[k], sample.wrench)
        code = _step(memory, samples, history, dft[0], twiddle, window, sums)
        if trace.shape[0]:
            if code == SKIPPED:
                trace[k].t = np.nan
            else:
                trace[k] = history[(memory.written - 1) % history.shape[0]]
        if code != NOTHING and code != SKIPPED:
            return k + 1, code
    return stop, NOTHING
