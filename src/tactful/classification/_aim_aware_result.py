"""What the aim-aware classifier answers, and why."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from tactful.classification._aim_aware_config import AimAwareConfig
from tactful.classification._aim_aware_kernel import IMPACTS
from tactful.classification._verdict import Evidence

Array = NDArray[np.float64]
ImpactVerdict = Literal["off", "yet unknown", "expected", "unexpected", "missed"]
Reason = Literal["missed", "early", "late", "wrong place", "impacts apart", "inclined", "motion"]

VERDICTS: tuple[ImpactVerdict, ...] = ("off", "yet unknown", "expected", "unexpected", "missed")
"""The verdicts in the order of their codes."""


@dataclass(frozen=True, slots=True)
class JointEvidence:
    """How the envelope of one joint's velocity error lay to zero, in the time that was judged.

    Attributes:
        joint: its index.
        needed_rad_s: the least margin e_m with which the joint does not violate its envelope; negative where the
            envelope held zero with room to spare, -inf where it was not judged [rad/s].
        at_s: when that was [s]; None where it was not judged.
        bound: the bound that came nearest to zero or crossed it: "lower" if the joint was faster than planned, "upper"
            if slower (in the positive sense of the joint).
        margin_rad_s: the margin e_m that it had [rad/s].
        violated_s: when it violated its envelope first [s]; None if it did not.
    """

    joint: int
    needed_rad_s: float
    at_s: float | None
    bound: Literal["lower", "upper"]
    margin_rad_s: float
    violated_s: float | None

    @property
    def excess_rad_s(self) -> float:
        """By how much the joint violated its envelope; 0 if it did not [rad/s]."""
        return max(0.0, self.needed_rad_s - self.margin_rad_s)


@dataclass(frozen=True, slots=True, eq=False)
class AimAwareResult:
    """The verdict on a planned impact, with what every threshold would have had to be for another one.

    The evidence does not depend on epsilon, zeta, iota and e_m, so thresholds can be chosen from it without another
    run: an impact is expected if and only if `timing_s`, `position_rad`, `spacing_s` and, where it is asked for,
    `tilt_deg` are within theirs, and so is `needed_rad_s` of each joint.

    Attributes:
        verdict: what the impact was; "off" before the plan's window.
        decided_s: since when that is the verdict [s]; None while there is none.
        instant: what the conditions at the time of impact say, as a first guess.
        impact_s: times of all detected impacts, at most 16 [s].
        judged: how many of them were there before the verdict.
        timing_s: t_j - t_d of the impact for which it is largest [s].
        position_rad: largest distance of the configuration at an impact from q_d(t_d) [rad].
        spacing_s: longest time between two impacts [s].
        joints: the evidence of each joint, since the last impact.
        q_first_rad, q_last_rad, q_end_rad: q - q_d(t_d) (n,) at the first and the last impact and at the end of the
            time that was judged [rad].
        tilt_deg: rotation of the tool against the plan about axes in the surface, at the end of that time; nan for a
            plan without `turn` [deg].
        peak_rate_nm_s: the rate of the residual with the largest magnitude, from the first impact on (n,) [Nm/s].
        mean_error_rad_s: mean velocity error in ten equal parts of the time xi after the first impact (10, n) [rad/s];
            nan where nothing was judged.
        skipped: samples that were not finite or did not advance in time.
    """

    verdict: ImpactVerdict
    decided_s: float | None
    instant: ImpactVerdict
    impact_s: tuple[float, ...]
    judged: int
    timing_s: float
    position_rad: float
    spacing_s: float
    joints: tuple[JointEvidence, ...]
    q_first_rad: Array
    q_last_rad: Array
    q_end_rad: Array
    tilt_deg: float
    peak_rate_nm_s: Array
    mean_error_rad_s: Array
    skipped: int
    config: AimAwareConfig

    @property
    def needed_rad_s(self) -> float:
        """The least margin e_m for all joints with which no envelope is violated [rad/s]."""
        return max(joint.needed_rad_s for joint in self.joints)

    @property
    def evidence(self) -> tuple[Evidence, ...]:
        """The rules that were broken, those at the time of impact first; if none was, the one that was nearest."""
        config = self.config
        if self.verdict == "missed" and not self.judged:
            return (Evidence("missed", None, config.latest_s, "missed: no impact came"),)
        if not self.judged:
            return ()
        late = "late" if self.timing_s > 0 else "early"
        worst = max(self.joints, key=lambda joint: joint.needed_rad_s - joint.margin_rad_s)
        sense = "too fast" if worst.bound == "lower" else "too slow"
        apart = f"{self.spacing_s * 1e3:.0f} ms between two impacts"
        rules = [
            ("timing", abs(self.timing_s), config.zeta_s, f"impact {abs(self.timing_s) * 1e3:.0f} ms {late}"),
            ("place", self.position_rad, config.epsilon_rad, f"impact {self.position_rad:.3f} rad from its place"),
            ("spacing", self.spacing_s, config.iota_s, apart),
        ]
        if config.tilt_deg is not None:
            rules.append(("tilt", self.tilt_deg, config.tilt_deg, f"the tool tilted by {self.tilt_deg:.1f} deg"))
        if np.isfinite(worst.needed_rad_s):
            text = f"joint {worst.joint + 1} {sense} after the impact, {worst.needed_rad_s:.3f} rad/s"
            rules.append(("envelope", worst.needed_rad_s, worst.margin_rad_s, text))
        rules.sort(key=lambda rule: -rule[1] / max(rule[2], 1e-9))
        broken = [rule for rule in rules if rule[1] > rule[2]]
        broken.sort(key=lambda rule: rule[0] == "envelope")  # what was wrong at the impact explains what follows
        kind = "expected" if self.verdict == "expected" else "unexpected" if broken else "so far expected"
        return tuple(
            Evidence(
                rule, float(value), float(limit), f"{kind}: {text} ({value:.3g} {'>' if broken else '<='} {limit:g})"
            )
            for rule, value, limit, text in (broken or rules[:1])
        )

    @property
    def reason(self) -> Reason | None:
        """What was wrong first; None unless the verdict is "unexpected" or "missed".

        "motion" means that the arm moves otherwise than planned after an impact that came in time, at its place.
        """
        if self.verdict not in ("missed", "unexpected"):
            return None
        if not self.judged:
            return "missed"
        broken = self.evidence[0].rule
        late: Reason = "late" if self.timing_s > 0 else "early"
        reasons: dict[str | None, Reason] = {"timing": late, "place": "wrong place", "spacing": "impacts apart"}
        reasons["tilt"] = "inclined"
        return reasons.get(broken, "motion")

    @property
    def confidence(self) -> float:
        """How far the verdict is from its thresholds, in [1/2, 1]; no calibrated probability."""
        if not self.judged:
            return 1.0 if self.verdict == "missed" else 0.5
        config = self.config
        ratios = [
            abs(self.timing_s) / config.zeta_s,
            self.position_rad / config.epsilon_rad,
            self.spacing_s / config.iota_s,
            0.0 if config.tilt_deg is None else self.tilt_deg / config.tilt_deg,
            *(max(joint.needed_rad_s, 0.0) / max(joint.margin_rad_s, 1e-9) for joint in self.joints),
        ]
        worst = max(ratios)
        return max(1.0, worst) / (1.0 + worst)


def result_of(aim: Any, config: AimAwareConfig) -> AimAwareResult:
    """Return what a record of `aim_aware_dtype` holds."""
    counts = aim["counts"][:, None]
    return AimAwareResult(
        verdict=VERDICTS[int(aim["verdict"])],
        decided_s=_time(aim["decided_s"]),
        instant=VERDICTS[int(aim["instant"])] if aim["judged"] else VERDICTS[int(aim["verdict"])],
        impact_s=tuple(float(t) for t in aim["impact_s"][: min(int(aim["seen"]), IMPACTS)]),
        judged=int(aim["judged"]),
        timing_s=float(aim["timing"]),
        position_rad=float(aim["position"]),
        spacing_s=float(aim["spacing"]),
        joints=tuple(
            JointEvidence(
                joint=i,
                needed_rad_s=float(aim["needed"][i]),
                at_s=_time(aim["needed_s"][i]),
                bound="lower" if aim["above"][i] else "upper",
                margin_rad_s=float(aim["e_m"][i]),
                violated_s=_time(aim["violated_s"][i]),
            )
            for i in range(len(aim["needed"]))
        ),
        q_first_rad=aim["q_first"].copy(),
        q_last_rad=aim["q_last"].copy(),
        q_end_rad=aim["q_end"].copy(),
        tilt_deg=float(np.degrees(aim["tilt"])) if aim["turn"].any() else np.nan,
        peak_rate_nm_s=aim["rate"].copy(),
        mean_error_rad_s=np.where(counts > 0, aim["slots"], np.nan),
        skipped=int(aim["skipped"]),
        config=config,
    )


def _time(t: float) -> float | None:
    return None if np.isnan(t) else float(t)
