"""The per-sample work on a planned impact: observer, impact detection and classification in one function."""

from __future__ import annotations

import functools
import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tactful._njit import njit
from tactful.classification import AimAwareConfig
from tactful.classification import _aim_aware_kernel as aim_aware
from tactful.classification._aim_aware_kernel import DECIDED_FROM, aim_aware_dtype, aim_aware_record
from tactful.dynamics import arm_record
from tactful.dynamics._arm import arm_dtype, motion_dtype
from tactful.dynamics.kernels import copy
from tactful.estimation import ObserverConfig
from tactful.estimation._momentum_observer import observe_motion, observer_dtype, observer_record
from tactful.impacts import ImpactPlan
from tactful.robots import Robot

Array = NDArray[np.float64]

NOTHING, IMPACT, DECIDED = range(3)
"""What a sample may bring: nothing, an impact, a verdict."""

_LEAD = 10.0
"""How long before the plan's window the observer starts [1 / K_O]."""


@functools.cache
def watch_dtype(n: int, window: int) -> np.dtype[np.void]:
    """Return the layout of what watches a planned impact of n joints."""
    return np.dtype(
        [
            ("arm", arm_dtype(n)),
            ("motion", motion_dtype(n)),
            ("observer", observer_dtype(n)),
            ("aim", aim_aware_dtype(n, window)),
            ("observed", "i8"),  # whether r is observed from tau, or is tau_ext behind a low-pass
            ("K_O", "f8"),
            ("r", "f8", (n,)),
            ("t", "f8"),  # of the sample
            ("q", "f8", (n,)),
            ("dq", "f8", (n,)),
            ("tau", "f8", (n,)),  # tau or tau_ext
            ("before", "f8"),  # time of the good sample before
            ("gap", "f8"),  # time without samples after which all starts anew [s]
            ("begin", "f8"),  # of the samples that count
            ("until", "f8"),
        ],
        align=True,
    )


def watch_record(
    robot: Robot, plan: ImpactPlan, config: AimAwareConfig, observer: ObserverConfig, *, observed: bool, gap_s: float
) -> Any:
    """Return a watch that has seen nothing.

    Args:
        robot: the arm.
        plan: what is to happen.
        config: the settings.
        observer: those of the observer, but for its bandwidth.
        observed: whether the samples hold tau, or tau_ext.
        gap_s: time without samples after which all starts anew [s].

    Raises:
        ConfigError: if a setting does not fit the robot or the plan.
    """
    record: Any = np.zeros(1, watch_dtype(plan.n, config.m_max))
    watch = record[0]
    watch["arm"] = arm_record(robot)[0]
    slow = observer.model_copy(update={"bandwidth_hz": config.bandwidth_hz})
    watch["observer"] = observer_record(robot, slow)[0]
    watch["aim"] = aim_aware_record(plan, config)[0]
    watch["observed"] = observed
    watch["K_O"] = 2 * math.pi * config.bandwidth_hz
    watch["before"] = -math.inf
    watch["gap"] = gap_s
    watch["begin"] = plan.start_s - _LEAD / watch["K_O"]
    watch["until"] = plan.end_s + 2 * config.xi_s
    return record


@njit(cache=True)
def _usable(watch: Any) -> bool:
    """Whether the sample is in time, and finite."""
    if not (watch.begin <= watch.t <= watch.until and watch.t > watch.before):
        return False
    for i in range(watch.q.shape[0]):
        if not (np.isfinite(watch.q[i]) and np.isfinite(watch.dq[i]) and np.isfinite(watch.tau[i])):
            return False
    return True


@njit(cache=True)
def _step(watch: Any, post_t: Array, post_dq: Array) -> int:
    if not _usable(watch):
        return NOTHING
    dt = watch.t - watch.before
    watch.before = watch.t
    aim = watch.aim
    start = dt > watch.gap
    if start:
        watch.observer.started = 0
        aim.detector.seen = 0
    if watch.observed:
        stands_for = observe_motion(watch.arm, watch.motion, watch.observer, dt, watch.q, watch.dq, watch.tau)
        if not (start or stands_for > 0.0):
            return NOTHING
        copy(watch.observer.r, watch.r)
    else:
        share = 1.0 if start else 1.0 - np.exp(-watch.K_O * dt)
        for i in range(watch.r.shape[0]):
            watch.r[i] += share * (watch.tau[i] - watch.r[i])
    impacts, verdict = aim.judged, aim.verdict
    now = aim_aware.step(aim, post_t, post_dq, watch.t, watch.q, watch.dq, watch.r)
    if now != verdict and now >= DECIDED_FROM:
        return DECIDED
    return IMPACT if aim.judged > impacts else NOTHING


@njit(cache=True)
def take(record: Any, post_t: Array, post_dq: Array, samples: Any) -> int:
    """Take the monitor's sample samples[0] and return what it brings."""
    watch, sample = record[0], samples[0]
    watch.t = sample.t
    copy(sample.q, watch.q)
    copy(sample.dq, watch.dq)
    copy(sample.tau, watch.tau)
    return _step(watch, post_t, post_dq)  # type: ignore[no-any-return]


@njit(cache=True)
def run(
    record: Any, post_t: Array, post_dq: Array, t: Array, q: Array, dq: Array, tau: Array, start: int, stop: int
) -> tuple[int, int]:
    """Take the rows from `start` on until one brings something, and return the row after it and what it brings."""
    watch = record[0]
    for k in range(start, stop):
        watch.t = t[k]
        copy(q[k], watch.q)
        copy(dq[k], watch.dq)
        copy(tau[k], watch.tau)
        news = _step(watch, post_t, post_dq)
        if news != NOTHING:
            return k + 1, news
    return stop, NOTHING
