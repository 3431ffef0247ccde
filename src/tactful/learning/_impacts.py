"""Planned impacts of which it is known how they are to be told, and what a classifier makes of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tactful.classification import AimAware, AimAwareConfig
from tactful.estimation import MomentumObserver
from tactful.impacts import ImpactPlan
from tactful.learning._errors import LearningError
from tactful.monitor import MonitorConfig
from tactful.recordings import Recording
from tactful.robots import Robot
from tactful.simulation.planar import PlanarConfig, simulate_impacts

Array = NDArray[np.float64]

EXPECTED, UNEXPECTED = "expected_impact", "unexpected_impact"
"""The kinds of the labels that say how an impact is to be told."""
THRESHOLDS = ("e_m_rad_s", "epsilon_rad", "zeta_s", "iota_s", "tilt_deg")
"""The settings in which the verdict is monotone: the larger, the more is accepted. The last one may be None."""
_LEAD_S = 0.05
"""How much of a run is kept before the time in which its plan speaks [s]."""
_SLACK_S = 1e-9


@dataclass(frozen=True, eq=False)
class LabelledImpact:
    """The samples around a planned impact, and what is to be said of it; N samples, n joints.

    Attributes:
        name: where it comes from.
        plan: what was to happen.
        t: (N,) [s].
        q: (N, n) joint positions [rad].
        dq: (N, n) joint velocities [rad/s].
        r: (N, n) residual of a momentum observer [Nm].
        touch_s: when the first contact began; inf if none did [s].
        expected: whether it is to be accepted.
    """

    name: str
    plan: ImpactPlan
    t: Array
    q: Array
    dq: Array
    r: Array
    touch_s: float
    expected: bool

    @classmethod
    def of_recording(
        cls, recording: Recording, plan: ImpactPlan, robot: Robot, settings: MonitorConfig
    ) -> LabelledImpact:
        """Take a recording with one label `expected_impact` or `unexpected_impact`, as a monitor would see it.

        Raises:
            LearningError: if there is another number of such labels, or no q, dq and tau.
        """
        labels = [label for label in recording.labels if label.kind in (EXPECTED, UNEXPECTED)]
        name = recording.source or "a recording"
        if len(labels) != 1:
            raise LearningError(f"{name}: {len(labels)} labels {EXPECTED} or {UNEXPECTED}; give it just one")
        q, dq, tau = recording.q, recording.dq, recording.tau
        if q is None or dq is None or tau is None:
            raise LearningError(f"{name} lacks q, dq or tau: an impact cannot be judged without them")
        if not (len(robot.joint_names) == plan.n == recording.n_joints):
            counts = f"{recording.n_joints} joints, its plan {plan.n}, the robot {len(robot.joint_names)}"
            raise LearningError(f"{name} has {counts}: give those that belong together")
        touch_s, expected = labels[0].start_s, labels[0].kind == EXPECTED
        if expected and not plan.start_s <= touch_s <= plan.end_s:
            problem = f"touches at {touch_s:.3f} s, but its plan speaks from {plan.start_s:g} to {plan.end_s:g} s"
            raise LearningError(f"{name}: the impact is to be expected and {problem}; mend the label or the plan")
        observing = settings.observer.model_copy(update={"bandwidth_hz": settings.aim_aware.bandwidth_hz})
        r = MomentumObserver(robot, observing).run(recording.t, q, dq, tau)
        samples = recording.t, q, dq, r
        return _cut(name, plan, samples, touch_s=touch_s, expected=expected)


def _cut(name: str, plan: ImpactPlan, samples: tuple[Array, ...], *, touch_s: float, expected: bool) -> LabelledImpact:
    t = samples[0]
    rows = (t >= plan.start_s - _LEAD_S) & (t <= plan.end_s)
    t, q, dq, r = (np.ascontiguousarray(x[rows]) for x in samples)
    return LabelledImpact(name, plan, t, q, dq, r, touch_s, expected)


def planar_impacts(cases: ArrayLike, planar: PlanarConfig, tolerance_deg: float, seed: int = 0) -> list[LabelledImpact]:
    """Simulate impacts of the planar arm; those on surfaces that are inclined by at most the tolerance are expected.

    Args:
        cases: (k, 3) alpha [deg], x_imp [m], beta [deg].
        planar: arm, task, contact, controller, sensors.
        tolerance_deg: largest inclination that is to be accepted [deg].
        seed: of the noise of the sensors.
    """
    return [
        _cut(
            f"alpha {run.alpha_deg:.4g} deg, x {run.x_imp_m:.3g} m, beta {run.beta_deg:.3g} deg",
            run.plan,
            (run.t, run.q, run.dq, run.r),
            touch_s=run.touches[0].time_s if run.touches else np.inf,
            expected=bool(within(run.beta_deg, tolerance_deg)),
        )
        for run in simulate_impacts(cases, planar, seed)
    ]


def within(beta_deg: ArrayLike, tolerance_deg: float) -> NDArray[np.bool_]:
    """Return whether surfaces with these inclinations [deg] are to be accepted."""
    return np.asarray(np.abs(beta_deg) <= tolerance_deg + 1e-9)


@dataclass(frozen=True, eq=False)
class Judged:
    """How one classifier saw k impacts; thresholds do not matter for it, so they can be chosen afterwards.

    Attributes:
        timing_s: |t_j - t_d|, the largest (k,) [s].
        position_rad: largest distance from q_d(t_d) at an impact (k,) [rad].
        spacing_s: longest time between two impacts (k,) [s].
        needed_rad_s: least margin e_m of each joint that holds (k, n); inf where no impact was felt or no verdict came
            [rad/s].
        tilt_deg: rotation of the tool against the plan at the end of the time that is judged, with the sign of its
            larger component (k,); nan where no impact was felt or the plan does not know it [deg].
        verdict_s: time from the first impact to the verdict (k,); nan where there is none [s].
        wait_s: the same from the last impact before it [s].
    """

    timing_s: Array
    position_rad: Array
    spacing_s: Array
    needed_rad_s: Array
    tilt_deg: Array
    verdict_s: Array
    wait_s: Array

    @classmethod
    def of(cls, runs: Sequence[LabelledImpact], config: AimAwareConfig) -> Judged:
        """Let a classifier judge impacts."""
        return cls.from_rows(np.array([judged_row(run, config) for run in runs]))

    @classmethod
    def from_rows(cls, rows: Array) -> Judged:
        """Take rows (k, 6 + n) of `judged_row`."""
        timing, position, spacing, tilt, verdict, wait = rows[:, :6].T
        return cls(timing, position, spacing, rows[:, 6:], tilt_deg=tilt, verdict_s=verdict, wait_s=wait)

    def needed(self) -> Array:
        """Return the least value of each of `THRESHOLDS`, the same for all joints, that accepts the impacts (k, 5)."""
        tilt = np.where(np.isfinite(self.tilt_deg), np.abs(self.tilt_deg), np.inf)
        parts = self.needed_rad_s.max(axis=1), self.position_rad, self.timing_s, self.spacing_s, tilt
        return np.stack(parts, axis=1)

    def accepted(self, config: AimAwareConfig) -> NDArray[np.bool_]:
        """Return which impacts are expected (k,), under the thresholds of a classifier with the same envelope."""
        return np.asarray(
            (self.timing_s <= config.zeta_s + _SLACK_S)
            & (self.position_rad <= config.epsilon_rad)
            & (self.spacing_s <= config.iota_s + _SLACK_S)
            & (config.tilt_deg is None or np.abs(self.tilt_deg) <= config.tilt_deg)
            & (self.needed_rad_s <= config.margins(self.needed_rad_s.shape[1])).all(axis=1)
        )


def judged_row(run: Any, config: AimAwareConfig) -> tuple[float, ...]:
    """Let a classifier judge an impact with `plan`, `t`, `q`, `dq` and `r`, and return a row of `Judged`."""
    aim = AimAware(run.plan, config)
    aim.run(run.t, run.q, run.dq, run.r)
    result = aim.result
    before = result.impact_s[: result.judged] or (np.nan,)
    decided = result.verdict in ("expected", "unexpected") and result.judged > 0
    return (
        abs(result.timing_s),
        result.position_rad,
        result.spacing_s,
        _tilt_deg(run.plan, result.q_end_rad) if result.judged else np.nan,
        *(result.decided_s - t if decided and result.decided_s else np.nan for t in (before[0], before[-1])),
        *(joint.needed_rad_s if decided else np.inf for joint in result.joints),
    )


def _tilt_deg(plan: ImpactPlan, error_rad: Array) -> float:
    if plan.turn is None:
        return np.nan
    parts = plan.turn @ error_rad
    return float(np.degrees(np.linalg.norm(parts)) * np.sign(parts[int(np.argmax(np.abs(parts)))]))
