"""The whole memory of a monitor: a few arrays that the kernel works on and that copy and pickle as they are."""

from __future__ import annotations

import functools
import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tactful.detection import AXES, frequency_arrays, thresholds
from tactful.detection._glr import glr_dtype, glr_record
from tactful.detection.contact_state import contact_dtype, contact_record
from tactful.dynamics import arm_record
from tactful.dynamics._arm import arm_dtype, motion_dtype
from tactful.estimation._momentum_observer import observer_dtype, observer_record
from tactful.estimation._wrench import wrench_dtype, wrench_record
from tactful.monitor._config import MonitorConfig
from tactful.robots import Robot

WHERE_HZ = 20.0
"""Each of the two poles behind which the external torque tells where a contact is [Hz]."""
HISTORY_S = 1.0
"""How much of the past the classifier can look at [s]."""
_STEADY_HZ = 500.0
"""Rate from which on stamps are taken for those of a host that jitters, and time for whole sample periods [Hz]."""
_UNKNOWN_LIMIT_NM, _SENSOR_LIMIT_NM = 50.0, 100.0
_WRENCH_SCALE = np.array([25.0, 25.0, 25.0, 5.0, 5.0, 5.0])
"""What the noise of a wrench is a share of [N, N, N, Nm, Nm, Nm]."""


@functools.cache
def memory_dtype(n: int, m: int, longest: int) -> np.dtype[np.void]:
    """Return the layout of the memory for n joints, m channels of the fast detector and its longest window."""
    return np.dtype(
        [
            ("arm", arm_dtype(n)),
            ("motion", motion_dtype(n)),
            ("observer", observer_dtype(n)),
            ("J", "f8", (6, n)),
            ("x", "f8", (3,)),
            ("wrench", wrench_dtype(n)),
            ("fast", "i8"),
            ("glr", glr_dtype(m, longest)),
            ("period", "f8"),  # by which the fast detector counts time [s]; 0: the stamps count
            ("elapsed", "f8"),  # since the last sample that was not a repeated one [s]
            ("slow_gain", "f8"),
            ("slow", "f8", (m,)),  # the slow external torque, or wrench
            ("where_gain", "f8"),
            ("where", "f8", (2, m)),  # the external torque that tells where a contact is, behind one and two poles
            ("locate_every", "i8"),  # [samples]; 0: the contact is not located
            ("locate_in", "i8"),
            ("bias_gain", "f8"),  # h / bias_s
            ("release", "f8", (m,)),  # tolerance of the slow signal when a contact ends, for thresholds of scale 1
            ("bias_limit", "f8", (m,)),
            ("bias", "f8", (m,)),  # what the external torque is off by while nothing suggests a contact
            ("contact", contact_dtype(len(AXES), max(m, 3))),
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
def row_dtype(n: int, m: int) -> np.dtype[np.void]:
    """Return the layout of what the monitor remembers of a sample, for n joints and m channels of the detector."""
    return np.dtype(
        [
            ("t", "f8"),  # [s]
            ("q", "f8", (n,)),  # [rad]
            ("tau_ext", "f8", (n,)),  # [Nm]
            ("wrench", "f8", (6,)),  # at the tip, base axes [N, Nm]
            ("twist", "f8", (6,)),  # of the tip, base axes [m/s, rad/s]
            ("level", "f8", (len(AXES),)),  # of x, y and z [N]; in fast mode of all, relative to its threshold
            ("signal", "f8", (max(m, 3),)),  # what says whether a contact is over: the force, or the slow torque
            ("state", "i8"),
        ],
        align=True,
    )


def _torque_scale(robot: Robot) -> NDArray[np.float64]:
    """Return what the noise of each joint's torque is a share of (n,) [Nm]."""
    limit = np.where(robot.torque_limit < np.inf, robot.torque_limit, _UNKNOWN_LIMIT_NM)
    return limit if robot.torque_sensor == "motor" else np.minimum(limit, _SENSOR_LIMIT_NM)


class Memory:
    """What a monitor knows: parameters, state and the recent past.

    Attributes:
        record: one record of `memory_dtype`.
        sample: the sample that is being taken, and after it the one before.
        history: the last rows, a ring.
        of_joints: whether the channels of the detector are joints, not a wrench.
        dft: the detector's tables and sums.
        arrays: all of them in the order in which the kernel takes them.
    """

    def __init__(self, robot: Robot | None, config: MonitorConfig, *, wrench: bool) -> None:
        self.n = 0 if robot is None else len(robot.joint_names)
        width = max(self.n, 1)
        rate_hz = config.rate_hz
        scale = _WRENCH_SCALE if wrench or robot is None else _torque_scale(robot)
        glr = glr_record(config.fast, config.noise, scale, rate_hz)
        self.channels = len(scale)
        self.of_joints = robot is not None and not wrench
        self.longest = glr.dtype["ring"].shape[1] // 2
        self.record: Any = np.zeros(1, memory_dtype(width, self.channels, self.longest))
        memory = self.record[0]
        if robot is not None:
            memory["arm"] = arm_record(robot)[0]
            memory["observer"] = observer_record(robot, config.observer)[0]
        memory["wrench"] = wrench_record(width, config.wrench)[0]
        memory["fast"] = config.mode == "fast"
        memory["glr"] = glr[0]
        memory["period"] = config.observer.clock_s or (1 / rate_hz if rate_hz >= _STEADY_HZ else 0.0)
        memory["slow_gain"] = 1 - math.exp(-2 * math.pi * config.fast.slow_hz / rate_hz)
        memory["where_gain"] = 1 - math.exp(-2 * math.pi * WHERE_HZ / rate_hz)
        memory["bias_gain"] = min(1.0, 1 / (config.fast.bias_s * rate_hz))
        memory["bias_limit"] = config.fast.bias_limit * config.noise.resolved("model_nm", scale)
        tolerance = np.full(max(self.channels, 3), np.inf)
        threshold = thresholds(config.frequency)
        if config.mode == "fast":
            memory["release"] = config.fast.release * config.noise.resolved("model_nm", scale)
            tolerance[: self.channels] = memory["release"]
            threshold = np.array([1.0, np.inf, np.inf])
        elif config.contact.release_force_n is not None:
            tolerance[:3] = config.contact.release_force_n
        fast = config.mode == "fast"
        memory["contact"] = contact_record(
            config.contact,
            threshold,
            tolerance,
            rate_hz,
            decide_s=config.fast.decide_s if fast else 0.0,
            until_quiet=not fast,
        )[0]
        memory["gap"] = max(config.contact.gap_s, 5 / rate_hz)
        fill = self.longest if config.mode == "fast" else config.frequency.window
        memory["warm_up"] = fill + round(config.contact.warm_up_s * rate_hz)
        memory["last_bad"] = -1
        self.sample: Any = np.zeros(2, sample_dtype(width))
        length = math.ceil(max(HISTORY_S, config.contact.search_s) * rate_hz) + 1
        self.history: Any = np.zeros(length, self.row_dtype)
        self.dft = frequency_arrays(config.frequency, rate_hz)

    @property
    def row_dtype(self) -> np.dtype[np.void]:
        """The layout of a row of the history."""
        return row_dtype(max(self.n, 1), self.channels)

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

    def retune(self, config: MonitorConfig) -> None:
        """Take the thresholds of a configuration, between two samples or during one."""
        if config.mode == "fast":
            for w, threshold in enumerate(config.fast.windows(config.rate_hz).values()):
                self.record["glr"]["threshold"][0, w] = threshold
        else:
            self.record["contact"]["threshold"][0] = thresholds(config.frequency)
