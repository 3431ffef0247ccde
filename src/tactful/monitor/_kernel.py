"""The per-sample work of the monitor: one function on preallocated records, for one sample and for many."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from tactful.detection.contact_state import FREE, NOTHING, advance, clear
from tactful.dynamics import kernels
from tactful.estimation._momentum_observer import observe_motion
from tactful.estimation._wrench import solve_wrench
from tactful.signals import _sliding_dft

Array = NDArray[np.float64]

TAU, TAU_EXT, WRENCH = range(3)
"""Sources of the force."""

SKIPPED, RESTARTED = 4, 5
"""What a sample may bring beyond what `contact_state` names: it was bad, or time jumped while there was a contact."""


@njit(cache=True)
def _finite(sample: Any) -> bool:
    if not np.isfinite(sample.t):
        return False
    for i in range(sample.q.shape[0]):
        if not (np.isfinite(sample.q[i]) and np.isfinite(sample.dq[i]) and np.isfinite(sample.tau[i])):
            return False
    for i in range(6):  # noqa: SIM110 (numba compiles the loop without an allocation)
        if not np.isfinite(sample.wrench[i]):
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
def _estimate(memory: Any, sample: Any, row: Any, dt: float) -> None:
    """Estimate external torque, wrench and twist, and write them into the row."""
    row.tau_ext[:] = sample.tau
    row.wrench[:] = sample.wrench
    row.twist[:] = 0.0
    if not sample.has_q:
        return
    arm, motion, J = memory.arm, memory.motion, memory.J
    kernels.place(arm, motion, sample.q)
    kernels.tip_position(arm, motion, memory.x)
    kernels.jacobian(arm, motion, arm.tip_link, memory.x, J)
    if sample.has_dq:
        for r in range(6):
            for i in range(J.shape[1]):
                row.twist[r] += J[r, i] * sample.dq[i]
    if sample.source == WRENCH:
        return
    if sample.source == TAU:
        observe_motion(arm, motion, memory.observer, dt, sample.q, sample.dq, sample.tau)
        row.tau_ext[:] = memory.observer.r
    solve_wrench(memory.wrench, J, row.tau_ext)
    row.wrench[:] = memory.wrench.F


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
            _sliding_dft.restart(dft, window, sums)
            if contact.state != FREE:
                code = RESTARTED
            clear(contact)
        elif _same(sample, before):
            memory.repeated += 1
    row = history[memory.written % history.shape[0]]
    _estimate(memory, sample, row, dt)
    row.t = sample.t
    dft.x[:] = row.wrench[:3]
    _sliding_dft.step(dft, twiddle, window, sums)
    row.level[:] = dft.level
    memory.t = sample.t
    memory.since_start += 1
    memory.written += 1
    if memory.since_start >= memory.warm_up:
        code = advance(contact, row.level, row.wrench[:3])
    row.state = contact.state
    before.q[:] = sample.q
    before.dq[:] = sample.dq
    before.tau[:] = sample.tau
    before.wrench[:] = sample.wrench
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
            sample.q[:] = q[k]
        if dq.shape[0]:
            sample.dq[:] = dq[k]
        if tau.shape[0]:
            sample.tau[:] = tau[k]
        if wrench.shape[0]:
            sample.wrench[:] = wrench[k]
        code = _step(memory, samples, history, dft[0], twiddle, window, sums)
        if trace.shape[0]:
            if code == SKIPPED:
                trace[k].t = np.nan
            else:
                trace[k] = history[(memory.written - 1) % history.shape[0]]
        if code != NOTHING and code != SKIPPED:
            return k + 1, code
    return stop, NOTHING
