"""What each part of the kernel takes."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numba import njit

from tactful import Monitor, Recording
from tactful.dynamics import kernels
from tactful.estimation._momentum_observer import observe_motion
from tactful.estimation._wrench import solve_wrench
from tactful.signals import _sliding_dft

PARTS = ("place the links", "momentum terms", "observer with both", "Jacobian of the tip", "wrench", "sliding DFT")


@njit
def _repeat(part: int, memory: Any, dft: Any, twiddle: Any, window: Any, sums: Any, q: Any, dq: Any, tau: Any) -> None:
    """Do one part for every row."""
    arm, motion = memory.arm, memory.motion
    for k in range(q.shape[0]):
        if part == 0:
            kernels.place(arm, motion, q[k])
        elif part == 1:
            kernels.momentum_terms(arm, motion, dq[k])
        elif part == 2:
            observe_motion(arm, motion, memory.observer, 1e-3, q[k], dq[k], tau[k])
        elif part == 3:
            kernels.tip_position(arm, motion, memory.x)
            kernels.jacobian(arm, motion, arm.tip_link, memory.x, memory.J)
        elif part == 4:
            solve_wrench(memory.wrench, memory.J, tau[k])
        else:
            for axis in range(3):
                dft.x[axis] = tau[k, axis]
            _sliding_dft.step(dft, twiddle, window, sums)


def parts(monitor: Monitor, recording: Recording) -> dict[str, Callable[[], Callable[[], None]]]:
    """Return for each part what prepares doing it for every row, with the memory of a monitor that it may use up."""
    monitor.run(recording)
    record, _, _, dft, twiddle, window, sums = monitor._memory.arrays
    rows = [np.ascontiguousarray(recording.channels[name]) for name in ("q", "dq", "tau")]

    def repeated(part: int) -> Callable[[], Callable[[], None]]:
        return lambda: lambda: _repeat(part, record[0], dft[0], twiddle, window, sums, *rows)

    return {name: repeated(part) for part, name in enumerate(PARTS)}
