"""The whole memory of a monitor: a few arrays that the kernel works on and that copy and pickle as they are."""

from __future__ import annotations

import functools
import math
from typing import Any

import numpy as np

from tactful.detection import AXES, frequency_arrays, thresholds
from tactful.detection.contact_state import contact_dtype, contact_record
from tactful.dynamics import arm_record
from tactful.dynamics._arm import arm_dtype, motion_dtype
from tactful.estimation._momentum_observer import observer_dtype, observer_record
from tactful.estimation._wrench import wrench_dtype, wrench_record
from tactful.monitor._config import MonitorConfig
from tactful.robots import Robot

HISTORY_S = 1.0
"""How much of the past the classifier can look at [s]."""


@functools.cache
def memory_dtype(n: int) -> np.dtype[np.void]:
    """Return the layout of the memory for n joints."""
    return np.dtype(
        [
            ("arm", arm_dtype(n)),
            ("motion", motion_dtype(n)),
            ("observer", observer_dtype(n)),
            ("J", "f8", (6, n)),
            ("x", "f8", (3,)),
            ("wrench", wrench_dtype(n)),
            ("contact", contact_dtype(len(AXES))),
            ("gap", "f8"),  # [s]
            ("warm_up", "i8"),  # [samples]
            ("t", "f8"),  # of the last good sample
            ("since_start", "i8"),  # good samples since the last start
            ("written", "i8"),  # rows written to the history
            ("samples", "i8"),
            ("nonfinite", "i8"),
            ("backward", "i8"),
            ("gaps", "i8"),
            ("repeated", "i8"),
            ("last_bad", "i8"),  # sample number
        ],
        align=True,
    )


@functools.cache
def sample_dtype(n: int) -> np.dtype[np.void]:
    """Return the layout of one sample; `has_q` and `has_dq` say whether these channels are there."""
    return np.dtype(
        [
            ("source", "i8"),
            ("has_q", "i8"),
            ("has_dq", "i8"),
            ("t", "f8"),
            ("q", "f8", (n,)),
            ("dq", "f8", (n,)),
            ("tau", "f8", (n,)),  # tau or tau_ext, as `source` says
            ("wrench", "f8", (6,)),
        ],
        align=True,
    )


@functools.cache
def row_dtype(n: int) -> np.dtype[np.void]:
    """Return the layout of what the monitor remembers of a sample."""
    return np.dtype(
        [
            ("t", "f8"),  # [s]
            ("tau_ext", "f8", (n,)),  # [Nm]
            ("wrench", "f8", (6,)),  # at the tip, base axes [N, Nm]
            ("twist", "f8", (6,)),  # of the tip, base axes [m/s, rad/s]
            ("level", "f8", (len(AXES),)),  # [N]
            ("state", "i8"),
        ],
        align=True,
    )


class Memory:
    """What a monitor knows: parameters, state and the recent past.

    Attributes:
        record: one record of `memory_dtype`.
        sample: the sample that is being taken, and after it the one before.
        history: the last rows, a ring.
        dft: the detector's tables and sums.
        arrays: all of them in the order in which the kernel takes them.
    """

    def __init__(self, robot: Robot | None, config: MonitorConfig) -> None:
        self.n = 0 if robot is None else len(robot.joint_names)
        width = max(self.n, 1)
        self.record: Any = np.zeros(1, memory_dtype(width))
        memory = self.record[0]
        if robot is not None:
            memory["arm"] = arm_record(robot)[0]
            memory["observer"] = observer_record(robot, config.observer)[0]
        memory["wrench"] = wrench_record(width, config.wrench)[0]
        memory["contact"] = contact_record(config.contact, thresholds(config.frequency), config.rate_hz)[0]
        memory["gap"] = max(config.contact.gap_s, 5 / config.rate_hz)
        memory["warm_up"] = config.frequency.window + round(config.contact.warm_up_s * config.rate_hz)
        memory["last_bad"] = -1
        self.sample: Any = np.zeros(2, sample_dtype(width))
        length = math.ceil(max(HISTORY_S, config.contact.search_s) * config.rate_hz) + 1
        self.history: Any = np.zeros(length, row_dtype(width))
        self.dft = frequency_arrays(config.frequency, config.rate_hz)

    @property
    def arrays(self) -> tuple[Any, ...]:
        """The arrays in the order in which the kernel takes them."""
        dft = self.dft
        return self.record, self.sample, self.history, dft.state, dft.twiddle, dft.window, dft.sums

    def recent(self, count: int) -> Any:
        """Return a copy of the last `count` rows, the newest last."""
        written = int(self.record["written"][0])
        count = min(count, written, len(self.history))
        return self.history[np.arange(written - count, written) % len(self.history)]
