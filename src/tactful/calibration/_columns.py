"""The residual of the observer as a linear function of what is calibrated."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tactful._njit import njit
from tactful.calibration._motion import Stretch
from tactful.calibration._pseudo_inertia import PARAMETERS
from tactful.dynamics import arm_record, kernels, motion_record
from tactful.estimation import ObserverConfig
from tactful.estimation._momentum_observer import observer_record
from tactful.estimation._velocity import sense, settled
from tactful.robots import Robot

Array = NDArray[np.float64]

HYSTERESIS_RAD = (0.0, 1e-3, 3e-3, 1e-2, 3e-2)
"""Displacements over which the Coulomb friction may be taken up [rad]; 0 is the tanh of the speed."""
BANDWIDTH_HZ = 10.0
"""Bandwidth of the residual that is fitted: what the motion moves is slower, most noise is faster [Hz]."""
_ROWS = 12_000
"""Rows that are kept at most."""


@dataclass(frozen=True, eq=False)
class Columns:
    """r = r_0 + A delta on `rows` samples.

    Attributes:
        r: residual of the nominal arm without bias and friction (k, n) [Nm].
        A: derivative by links (10 n), motor inertias (n), bias (n), viscous friction (n) and Coulomb friction
            (n for each of HYSTERESIS_RAD), (k, n, 17 n) in that order.
        t: time (k,) [s].
        stretch: from which stretch each row is (k,).
        v: velocity (k, n) [rad/s].
        rate_hz: rate of the rows [Hz].
    """

    r: Array
    A: Array
    t: Array
    stretch: NDArray[np.int64]
    v: Array
    rate_hz: float

    def of(self, rows: NDArray[np.bool_]) -> Columns:
        """Return some of the rows."""
        return Columns(self.r[rows], self.A[rows], self.t[rows], self.stretch[rows], self.v[rows], self.rate_hz)


def columns_of(stretches: Sequence[Stretch], robot: Robot, config: ObserverConfig) -> Columns:
    """Return the residual and its derivatives on evenly spread samples.

    The observer's residual is linear in the inertial parameters, as p, C^T dq and g are, and in bias and friction. It
    needs no acceleration, and it is what the monitor looks at later.
    """
    n = robot.n
    arms = np.concatenate([arm_record(robot), *_units(robot)])
    plain: Any = observer_record(robot, config)[0]
    total = sum(len(stretch) for stretch in stretches)
    duration_s = sum(stretch.duration_s for stretch in stretches)
    stride = max(1, round(total / duration_s / (5 * BANDWIDTH_HZ)), -(-total // _ROWS))
    results = []
    for number, stretch in enumerate(stretches):
        count = len(stretch) // stride
        r = np.empty((count, n, len(arms) + (2 + len(HYSTERESIS_RAD)) * n))
        t, v = np.empty(count), np.empty((count, n))
        dt = np.diff(stretch.t, prepend=stretch.t[0])
        plain["velocity"]["count"] = 0
        kept = _filtered(
            arms,
            motion_record(n)[0],
            plain["velocity"],
            2 * np.pi * BANDWIDTH_HZ,
            plain["coulomb_speed"],
            np.array(HYSTERESIS_RAD),
            stride,
            dt,
            *(np.require(x, np.float64, ["C", "W"]) for x in (stretch.q, stretch.dq, stretch.tau)),
            stretch.t.copy(),
            r,
            t,
            v,
        )
        settling = int(np.searchsorted(t[:kept], stretch.t[0] + 5 / (2 * np.pi * BANDWIDTH_HZ)))
        rows = slice(settling, kept)
        results.append((r[rows], t[rows], v[rows], np.full(kept - settling, number)))
    r, t, v, which = (np.concatenate(part) for part in zip(*results, strict=True))
    return Columns(r[..., 0], r[..., 1:], t, which, v, total / duration_s / stride)


def _units(robot: Robot) -> list[Any]:
    """Return an arm for each inertial parameter that has this one alone, and one for each motor inertia."""
    arms = []
    pairs = ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2))
    for i in range(robot.n):
        for parameter in range(PARAMETERS):
            arm = _empty(robot)
            if parameter == 0:
                arm["mass"][0, i] = 1.0
            elif parameter < 4:
                arm["first_moment"][0, i, parameter - 1] = 1.0
            else:
                a, b = pairs[parameter - 4]
                arm["inertia"][0, i, a, b] = arm["inertia"][0, i, b, a] = 1.0
            arms.append(arm)
    for i in range(robot.n):
        arm = _empty(robot)
        arm["motor_inertia"][0, i] = 1.0
        arms.append(arm)
    return arms


def _empty(robot: Robot) -> Any:
    arm: Any = arm_record(robot)
    for field in ("mass", "first_moment", "inertia", "motor_inertia"):
        arm[field] = 0.0
    return arm


@njit(cache=True)
def _filtered(
    arms: Any,
    motion: Any,
    velocity: Any,
    K: float,
    coulomb_speed: float,
    hysteresis: Array,
    stride: int,
    dt: Array,
    q: Array,
    dq: Array,
    tau: Array,
    stamps: Array,
    out: Array,
    t: Array,
    v: Array,
) -> int:
    """Run the observer on every column at once, write each stride-th sample, and return how many were written.

    The first column is the residual of arms[0] to the torque, the next are those of the other arms without torque, the
    rest those of bias, viscous and Coulomb friction.
    """
    n = q.shape[1]
    count = out.shape[2]
    first = arms.shape[0]
    p, s = np.zeros((n, count)), np.zeros((n, count))
    p_before, s_before, r = np.zeros((n, count)), np.zeros((n, count)), np.zeros((n, count))
    z = np.zeros((hysteresis.shape[0], n))
    started = False
    written = 0
    for k in range(dt.shape[0]):
        step = sense(velocity, k == 0, dt[k], q[k], dq[k], tau[k])
        if k > 0 and step == 0.0:
            continue
        speed = velocity.v
        kernels.place(arms[0], motion, velocity.q_v)
        for c in range(first):
            kernels.momentum_terms(arms[c], motion, speed)
            for i in range(n):
                p[i, c] = motion.p[i]
                s[i, c] = motion.ctdq[i] - motion.g[i]
        for i in range(n):
            s[i, 0] += velocity.tau_v[i]
            s[i, first + i] = -1.0
            s[i, first + n + i] = -speed[i]
            for h in range(hysteresis.shape[0]):
                if hysteresis[h] == 0.0:
                    z[h, i] = np.tanh(speed[i] / coulomb_speed)
                elif k > 0:
                    x = step * speed[i] / hysteresis[h]
                    z[h, i] = (z[h, i] + x) / (1.0 + abs(x))
                s[i, first + (2 + h) * n + i] = -z[h, i]
        half = 0.5 * step
        for i in range(n):
            for c in range(count):
                if started:
                    change = p[i, c] - p_before[i, c]
                    r[i, c] = ((1.0 - half * K) * r[i, c] + K * (change - half * (s[i, c] + s_before[i, c]))) / (
                        1.0 + half * K
                    )
                else:
                    r[i, c] = -s[i, c]
                p_before[i, c] = p[i, c]
                s_before[i, c] = s[i, c]
        started = settled(velocity)
        if k % stride == stride - 1 and written < out.shape[0]:
            out[written] = r
            t[written] = stamps[k]
            v[written] = speed
            written += 1
    return written
