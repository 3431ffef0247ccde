"""Algorithm 1 of the aim-aware paper as a kernel: one sample in, the verdict out."""

from __future__ import annotations

import functools
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tactful._njit import njit
from tactful.classification._aim_aware_config import AimAwareConfig
from tactful.config import ConfigError
from tactful.detection._impact import detect, impact_dtype, impact_record
from tactful.dynamics.kernels import copy
from tactful.impacts import ImpactPlan
from tactful.signals._envelope import advance, envelope_dtype, envelope_record, remember, restart

Array = NDArray[np.float64]

OFF, YET_UNKNOWN, EXPECTED, UNEXPECTED, MISSED = range(5)
"""Verdicts."""
DECIDED_FROM = EXPECTED
"""The verdicts from this one on are final words on what was seen so far."""

IMPACTS = 16
"""Impacts whose times are kept."""
SLOTS = 10
"""Pieces of equal length into which the time xi after the first impact is cut for the mean velocity error."""
_SLACK_S = 1e-9
"""Rounding of times that is not taken for a difference [s]."""


@functools.cache
def aim_aware_dtype(n: int, window: int) -> np.dtype[np.void]:
    """Return the layout of the settings and the state for n joints and windows of up to `window` + 1 samples."""
    return np.dtype(
        [
            ("detector", impact_dtype(n)),
            ("envelope", envelope_dtype(n, window)),
            ("literal", "i8"),
            ("from_first", "i8"),  # whether xi begins at the first impact, or at the last one
            ("enveloped", "i8"),
            ("m_c", "i8"),
            ("zeta", "f8"),
            ("epsilon", "f8"),
            ("iota", "f8"),
            ("xi", "f8"),
            ("e_m", "f8", (n,)),
            ("tilt_max", "f8"),  # [rad]; inf: not judged
            ("turn", "f8", (2, n)),  # how an error of the joints turns the tool
            ("t_d", "f8"),
            ("q_d", "f8", (n,)),
            ("start", "f8"),  # of the plan's window
            ("end", "f8"),
            ("latest", "f8"),  # time at which an impact is missed
            # the state
            ("samples", "i8"),
            ("skipped", "i8"),
            ("t", "f8"),
            ("row", "i8"),  # of the post-impact reference
            ("e", "f8", (n,)),  # velocity error [rad/s]
            ("seen", "i8"),  # impacts within the plan's window
            ("judged", "i8"),  # impacts before the verdict: j
            ("impact_s", "f8", (IMPACTS,)),
            ("t_j", "f8"),
            ("k", "i8"),  # samples since the impact j
            ("instant", "i8"),
            ("post", "i8"),
            ("verdict", "i8"),
            ("decided_s", "f8"),
            ("latched", "i8"),
            # the evidence: what every threshold would have to be
            ("timing", "f8"),  # t_j - t_d of the impact where it is largest [s]
            ("position", "f8"),  # [rad]
            ("spacing", "f8"),  # [s]
            ("needed", "f8", (n,)),  # largest max(lower, -upper) since the last impact [rad/s]; -inf: not judged
            ("needed_s", "f8", (n,)),
            ("above", "i8", (n,)),  # whether that is the lower bound, which lies above zero
            ("violated_s", "f8", (n,)),  # first violation since the last impact; nan: none
            ("q_first", "f8", (n,)),  # q - q_d at the first impact [rad]
            ("q_last", "f8", (n,)),  # and at the last one
            ("q_end", "f8", (n,)),  # and at the verdict
            ("tilt", "f8"),  # of the tool at the verdict [rad]
            ("rate", "f8", (n,)),  # dr/dt of the largest magnitude from the first impact on [Nm/s]
            ("slots", "f8", (SLOTS, n)),  # mean velocity error in pieces of xi / SLOTS since the first impact [rad/s]
            ("counts", "i8", (SLOTS,)),
        ],
        align=True,
    )


def aim_aware_record(plan: ImpactPlan, config: AimAwareConfig) -> Any:
    """Return a classifier that has seen nothing.

    Raises:
        ConfigError: if a setting has another number of joints than the plan, or asks for a tilt that it cannot tell.
    """
    n = plan.n
    record: Any = np.zeros(1, aim_aware_dtype(n, config.m_max))
    aim = record[0]
    aim["detector"] = impact_record(n, config.impact)[0]
    aim["envelope"] = envelope_record(n, config.a_per_s, config.m_max)[0]
    aim["literal"] = config.variant == "literal"
    aim["enveloped"] = config.envelope
    aim["from_first"] = config.xi_from == "first"
    aim["m_c"] = config.m_c
    aim["zeta"], aim["epsilon"], aim["iota"], aim["xi"] = config.zeta_s, config.epsilon_rad, config.iota_s, config.xi_s
    aim["e_m"] = config.margins(n)
    if plan.turn is not None:
        aim["turn"] = plan.turn
    elif config.tilt_deg is not None:
        problem = "needs a plan that knows how the tool turns: give it contacts, and ImpactPlan.with_turn(robot)"
        raise ConfigError("aimaware", "tilt_deg", problem, config.tilt_deg)
    aim["tilt_max"] = np.inf if config.tilt_deg is None else np.radians(config.tilt_deg)
    aim["t_d"], aim["q_d"] = plan.t_d_s, plan.q_d
    aim["start"], aim["end"] = plan.start_s, plan.end_s
    aim["latest"] = min(plan.t_d_s + config.latest_s, plan.end_s)
    clear(aim)
    return record


def clear(aim: Any) -> None:
    """Forget all samples."""
    for name in ("samples", "skipped", "row", "seen", "judged", "k", "latched", "counts", "above"):
        aim[name] = 0
    for name in ("e", "timing", "position", "spacing", "q_first", "q_last", "q_end", "tilt", "rate", "slots"):
        aim[name] = 0.0
    for name in ("impact_s", "decided_s", "needed_s", "violated_s"):
        aim[name] = np.nan
    aim["needed"] = -np.inf
    aim["t"] = aim["t_j"] = -np.inf
    aim["instant"], aim["post"], aim["verdict"] = YET_UNKNOWN, OFF, OFF
    detector, envelope = aim["detector"], aim["envelope"]
    detector["seen"], detector["since"], detector["rate"] = 0, np.inf, 0.0
    envelope["filled"] = 0


@njit(cache=True)
def _usable(aim: Any, t: float, q: Array, dq: Array, r: Array) -> bool:
    if not (np.isfinite(t) and t > aim.t):
        return False
    for i in range(q.shape[0]):  # noqa: SIM110 (numba compiles the loop without an allocation)
        if not (np.isfinite(q[i]) and np.isfinite(dq[i]) and np.isfinite(r[i])):
            return False
    return True


@njit(cache=True)
def _compare(aim: Any, post_t: Array, post_dq: Array, t: float, dq: Array) -> None:
    """Set the velocity error e = dq - dq_d(t); dq_d is linear between the rows and constant beyond them."""
    last = post_t.shape[0] - 1
    while aim.row < last - 1 and t >= post_t[aim.row + 1]:
        aim.row += 1
    k = aim.row
    share = 0.0
    if last > 0 and t > post_t[0]:
        share = min((t - post_t[k]) / (post_t[k + 1] - post_t[k]), 1.0)
    for i in range(dq.shape[0]):
        aim.e[i] = dq[i] - post_dq[k, i]
        if share > 0.0:
            aim.e[i] = dq[i] - ((1.0 - share) * post_dq[k, i] + share * post_dq[k + 1, i])


@njit(cache=True)
def _instant(aim: Any, t: float, q: Array) -> None:
    """Take an impact: (10), (11), (12), and the envelope anew."""
    if aim.judged == 0:
        for i in range(q.shape[0]):
            aim.q_first[i] = q[i] - aim.q_d[i]
    timing = t - aim.t_d
    spacing = t - aim.t_j if aim.judged > 0 else 0.0
    position = 0.0
    for i in range(q.shape[0]):
        aim.q_last[i] = q[i] - aim.q_d[i]
        position += aim.q_last[i] * aim.q_last[i]
        aim.needed[i] = -np.inf
        aim.needed_s[i] = np.nan
        aim.violated_s[i] = np.nan
    position = np.sqrt(position)
    if aim.literal or abs(timing) > abs(aim.timing):
        aim.timing = timing
    aim.position = position if aim.literal else max(position, aim.position)
    aim.spacing = spacing if aim.literal else max(spacing, aim.spacing)
    fits = abs(aim.timing) <= aim.zeta + _SLACK_S and aim.spacing <= aim.iota + _SLACK_S
    if fits and aim.position <= aim.epsilon:
        aim.instant = EXPECTED
        aim.post = YET_UNKNOWN
    else:
        aim.instant = UNEXPECTED
        aim.post = UNEXPECTED
    aim.judged += 1
    aim.t_j = t
    aim.k = 0
    restart(aim.envelope, aim.e, 1 if aim.literal else 0)


@njit(cache=True)
def _judge(aim: Any, t: float) -> bool:
    """Compare the bounds with zero, (17); return whether they violate the margins."""
    violated = False
    for i in range(aim.e.shape[0]):
        lower, upper = aim.envelope.lower[i], aim.envelope.upper[i]
        needed = max(lower, -upper)
        if needed > aim.needed[i]:
            aim.needed[i] = needed
            aim.needed_s[i] = t
            aim.above[i] = lower >= -upper
        if needed > aim.e_m[i]:
            violated = True
            if np.isnan(aim.violated_s[i]):
                aim.violated_s[i] = t
    return violated


@njit(cache=True)
def _record(aim: Any, t: float, q: Array) -> None:
    """Keep what a finer verdict needs."""
    slot = int((t - aim.impact_s[0] + _SLACK_S) / aim.xi * SLOTS)
    if slot < SLOTS:
        aim.counts[slot] += 1
    for i in range(q.shape[0]):
        if abs(aim.detector.rate[i]) > abs(aim.rate[i]):
            aim.rate[i] = aim.detector.rate[i]
        if slot < SLOTS:
            aim.slots[slot, i] += (aim.e[i] - aim.slots[slot, i]) / aim.counts[slot]
        aim.q_end[i] = q[i] - aim.q_d[i]
    first = second = 0.0
    for i in range(q.shape[0]):
        first += aim.turn[0, i] * aim.q_end[i]
        second += aim.turn[1, i] * aim.q_end[i]
    aim.tilt = np.sqrt(first * first + second * second)


@njit(cache=True)
def step(aim: Any, post_t: Array, post_dq: Array, t: float, q: Array, dq: Array, r: Array) -> int:
    """Take one sample and return the verdict."""
    aim.samples += 1
    if not _usable(aim, t, q, dq, r):
        aim.skipped += 1
        return aim.verdict  # type: ignore[no-any-return]
    dt = t - aim.t
    aim.t = t
    impact = detect(aim.detector, dt, r)
    _compare(aim, post_t, post_dq, t, dq)
    remember(aim.envelope, aim.e)
    if aim.literal == 0 and (t < aim.start - _SLACK_S or t > aim.end + _SLACK_S):
        impact = False
    if impact:
        if aim.seen < IMPACTS:
            aim.impact_s[aim.seen] = t
        aim.seen += 1
    if aim.latched:
        return aim.verdict  # type: ignore[no-any-return]
    if impact:
        _instant(aim, t, q)
    elif aim.judged > 0:
        aim.k += 1
        if aim.enveloped:
            advance(aim.envelope, dt)
        else:
            restart(aim.envelope, aim.e, 0)
    violated = False
    since = aim.impact_s[0] if aim.from_first else aim.t_j
    if aim.judged > 0 and t - dt - since <= aim.xi + _SLACK_S:
        _record(aim, t, q)
        violated = aim.k >= aim.m_c and _judge(aim, t)
    over = t - since > aim.xi + _SLACK_S
    if aim.post == YET_UNKNOWN:
        if violated:
            aim.post = UNEXPECTED
        elif over:
            aim.post = EXPECTED if aim.tilt <= aim.tilt_max else UNEXPECTED
    verdict = aim.verdict
    if aim.judged == 0 and aim.literal == 0:
        if verdict == OFF and aim.start - _SLACK_S <= t <= aim.latest + _SLACK_S:
            verdict = YET_UNKNOWN
        elif verdict == YET_UNKNOWN and t > aim.latest + _SLACK_S:
            verdict = MISSED
    elif aim.post != YET_UNKNOWN and over:
        verdict = EXPECTED if aim.instant == EXPECTED and aim.post == EXPECTED else UNEXPECTED
        aim.latched = 1 - aim.literal
    if verdict != aim.verdict:
        aim.decided_s = t if verdict != YET_UNKNOWN else np.nan
        aim.verdict = verdict
    return verdict  # type: ignore[no-any-return]


@njit(cache=True)
def run(
    aim: Any,
    post_t: Array,
    post_dq: Array,
    t: Array,
    q: Array,
    dq: Array,
    r: Array,
    verdict: NDArray[np.int8],
    e: Array,
    lower: Array,
    upper: Array,
) -> None:
    """Take all rows; the verdicts have a row for every sample, the error and its bounds for every sample or none."""
    for k in range(t.shape[0]):
        verdict[k] = step(aim, post_t, post_dq, t[k], q[k], dq[k], r[k])
        if e.shape[0]:
            copy(aim.e, e[k])
            copy(aim.envelope.lower, lower[k])
            copy(aim.envelope.upper, upper[k])
