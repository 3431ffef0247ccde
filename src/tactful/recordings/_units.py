"""Units that a file does not state, judged from its values and always said."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

DEGREE = math.pi / 180.0
_TIME_UNITS = (("s", 1.0), ("ms", 1e-3), ("us", 1e-6), ("ns", 1e-9))
_SLOWEST_HZ = 2.0
_FAR_RAD = 4.0 * math.pi
_EPOCH_S = (1e9, 4.2e9)
_PAIRS = 100_000  # enough to judge a unit by, of a recording of any length


def judge_time(t: Array, q: Array | None, dq: Array | None) -> tuple[float, list[str]]:
    """Seconds in the unit of `t`, and why.

    Where positions and velocities are known, dq dt = dq/dt decides: the slope of diff(q) over dq dt is 1 in seconds and
    1e-3 in milliseconds. Else stamps of the size of a unix time decide, else the median step: nothing that is worth
    monitoring is logged slower than 2 Hz.
    """
    slope = position_slope(t, q, dq)
    if slope is not None:
        name, factor = min(_TIME_UNITS, key=lambda unit: _distance(slope, unit[1]))
        if _distance(slope, factor) < math.log(1.5):
            return factor, _said(name, factor, f"diff(q) is {slope:.3g} of dq dt")
    finite = t[np.isfinite(t)]
    if finite.size and (stamp := abs(float(finite[0]))) >= _EPOCH_S[0]:
        for name, factor in _TIME_UNITS:
            if _EPOCH_S[0] <= stamp * factor < _EPOCH_S[1]:
                return factor, _said(name, factor, "unix time")
    step = median_step(t)
    for name, factor in _TIME_UNITS:
        if step * factor < 1.0 / _SLOWEST_HZ:
            return factor, _said(name, factor, f"median step {step:g}")
    return 1.0, []


def judge_positions(t: Array, channels: dict[str, Array]) -> list[str]:
    """Replace channels in degrees by ones in radians, and say so."""
    q, dq = channels.get("q"), channels.get("dq")
    slope = position_slope(t, q, dq)
    if slope is not None and _distance(slope, 1.0 / DEGREE) < math.log(1.5):
        channels["q"] = channels["q"] * DEGREE
        return [f"q in degrees, converted to rad: diff(q) is {slope:.1f} times dq dt"]
    if slope is not None and _distance(slope, DEGREE) < math.log(1.5):
        channels["dq"] = channels["dq"] * DEGREE
        return [f"dq in degrees a second, converted to rad/s: diff(q) is 1/{1.0 / slope:.1f} of dq dt"]
    reach = largest(q)
    if reach <= _FAR_RAD:
        return []
    channels["q"] = channels["q"] * DEGREE
    if dq is None:
        return [f"q in degrees, converted to rad: it reaches {reach:.1f}"]
    channels["dq"] = dq * DEGREE
    agree = "agrees with" if slope is not None else "is assumed to go with"
    return [f"q and dq in degrees, converted to rad: q reaches {reach:.1f} and dq {agree} it"]


def units_would_be_judged(t: Array, channels: Mapping[str, Array]) -> bool:
    """Whether values in SI units look like others, as those of a joint that turns on and on do."""
    factor, _ = judge_time(t, channels.get("q"), channels.get("dq"))
    return factor != 1.0 or bool(judge_positions(t, dict(channels)))


def position_slope(t: Array, q: Array | None, dq: Array | None) -> float | None:
    """Slope of diff(q) over the mean velocity times dt, by least squares; None where the arm does not move enough.

    1 where q, dq and t have matching units, 57.3 where only q is in degrees.
    """
    if q is None or dq is None or q.shape != dq.shape or len(t) < 10:
        return None
    rows = np.unique(np.linspace(0, len(t) - 2, min(len(t) - 1, _PAIRS), dtype=np.intp))
    with np.errstate(invalid="ignore", over="ignore"):
        step = t[rows + 1] - t[rows]
        moved = q[rows + 1] - q[rows]
        expected = 0.5 * (dq[rows + 1] + dq[rows]) * step[:, None]
        good = (step > 0) & (step < 5.0 * median_step(t)) & np.isfinite(moved).all(1) & np.isfinite(expected).all(1)
        if np.count_nonzero(good) < 10:
            return None
        moved, expected = moved[good], expected[good]
        xx, xy, yy = float(np.sum(expected**2)), float(np.sum(expected * moved)), float(np.sum(moved**2))
        travel = float(np.ptp(q[rows[good]], axis=0).max())
    if not all(map(math.isfinite, (xx, xy, yy))) or travel < 0.01 or xx <= 0.0 or yy <= 0.0:
        return None
    return xy / xx if xy / math.sqrt(xx * yy) > 0.7 else None


def median_step(t: Array) -> float:
    """Median of the positive steps; nan where there is none."""
    step = np.diff(t[np.isfinite(t)])
    step = step[step > 0]
    return float(np.median(step)) if step.size else float("nan")


def _said(name: str, factor: float, why: str) -> list[str]:
    return [] if factor == 1.0 else [f"time in {name}, converted to s ({why})"]


def _distance(a: float, b: float) -> float:
    return abs(math.log(a / b)) if a > 0 else math.inf


def largest(values: Array | None) -> float:
    """Largest finite magnitude; 0 where there is none."""
    if values is None:
        return 0.0
    finite = np.isfinite(values)
    return float(max(np.max(values, initial=0.0, where=finite), -np.min(values, initial=0.0, where=finite)))
