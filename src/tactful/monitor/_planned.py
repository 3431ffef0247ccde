"""A planned impact, as the monitor tells of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tactful.classification import AimAwareResult, Evidence, ImpactCause, ImpactCauses, Kind, impact_features
from tactful.classification._aim_aware_result import result_of
from tactful.classification._impact_cause import PLANNED, UNKNOWN
from tactful.impacts import ImpactPlan
from tactful.monitor._config import MonitorConfig
from tactful.monitor._contacts import Contacts
from tactful.monitor._event import ContactEvent
from tactful.monitor._memory import Memory
from tactful.monitor._planned_kernel import DECIDED, NOTHING, run, take, watch_record
from tactful.robots import Robot

Array = NDArray[np.float64]

_TOGETHER_S = 0.05
"""How long before the onset of a contact an impact may be that began it [s]."""
_BEFORE_S = 0.02
"""Time before an impact over which the force is averaged that was there already [s]."""
_KINDS: dict[str, Kind] = {
    "expected": "expected_impact",
    "unexpected": "unexpected_impact",
    "missed": "unexpected_impact",
}


class Planned:
    """Watches for a planned impact and says what it was; what was felt at other times is left to the contacts.

    A contact with an impact in it that began within the plan's window is the planned one: its kind is what the
    conditions at the time of impact say, and then the verdict. Without a contact (nothing came, or the detector of
    contacts did not feel it) the verdict is an event of its own, which has ended.

    Args:
        robot: the arm.
        plan: what is to happen.
        config: the settings.
        observed: whether the samples hold tau, or tau_ext.
        causes: what tells what went wrong.
    """

    def __init__(
        self,
        robot: Robot,
        plan: ImpactPlan,
        config: MonitorConfig,
        *,
        observed: bool,
        causes: ImpactCauses | None = None,
    ) -> None:
        if plan.contacts and plan.turn is None:
            plan = plan.with_turn(robot)
        self.plan = plan
        self.cause: ImpactCause | None = None
        self._robot, self._causes = robot, causes
        self._config = config.aim_aware
        gap_s = max(config.contact.gap_s, 5 / config.rate_hz)
        self._watch: Any = watch_record(robot, plan, config.aim_aware, config.observer, observed=observed, gap_s=gap_s)
        self._reference = (np.array(plan.post_t_s), np.array(plan.post_dq))
        self._result: AimAwareResult | None = None
        self._claimed: ContactEvent | None = None
        self._details: tuple[Evidence, ...] = ()

    @property
    def result(self) -> AimAwareResult | None:
        """What is known of the impact; None before there was one or it was missed."""
        return self._result

    def take(self, memory: Memory) -> int:
        """Take the sample of the monitor's memory and return what it brings."""
        return take(self._watch, *self._reference, memory.sample)  # type: ignore[no-any-return]

    def run(self, rows: Sequence[Array], start: int, stop: int) -> tuple[int, int]:
        """Take rows of t, q, dq and torque until one brings something; return the row after it and what it brings."""
        t, q, dq, tau = rows[:4]
        return run(self._watch, *self._reference, t, q, dq, tau, start, stop)  # type: ignore[no-any-return]

    def tell(self, event: ContactEvent | None, news: int, contacts: Contacts, memory: Memory) -> ContactEvent | None:
        """Return what a sample brought: the contacts' event, as the plan sees it, or what the plan has to say."""
        if news != NOTHING:
            self._result = result_of(self._watch[0]["aim"], self._config)
        if news == DECIDED:
            self._explain()
        if event is not None:
            event = self.rephrase(event)
        if news == NOTHING:
            return event
        own = self._own(news, contacts, memory)
        if event is None or own is None or (event.id, event.kind) == (own.id, own.kind):
            return event or own
        contacts.waiting.append(own)
        return event

    def rephrase(self, event: ContactEvent) -> ContactEvent:
        """Return an event of the contacts with the kind that the plan gives it, if it is the planned impact."""
        result = self._result
        if result is None or event.kind in _KINDS.values() or not self._is_planned(event, result):
            return event
        self._claimed = self._as_impact(event, result)
        return self._claimed

    def _is_planned(self, event: ContactEvent, result: AimAwareResult) -> bool:
        end_s = np.inf if event.end_s is None else event.end_s
        began = self.plan.start_s <= event.onset_s <= self.plan.end_s
        return began and any(event.onset_s - _TOGETHER_S <= t <= end_s for t in result.impact_s)

    def _as_impact(self, event: ContactEvent, result: AimAwareResult) -> ContactEvent:
        told = result.verdict in _KINDS and (result.judged == 0) == (result.verdict == "missed")
        kind = _KINDS[result.verdict if told else result.instant]
        reason: str | None = None
        if told and kind == "unexpected_impact":
            known = self.cause is not None and self.cause.cause not in (PLANNED, UNKNOWN)
            reason = self.cause.cause if self.cause is not None and known else result.reason
        return replace(
            event,
            kind=kind,
            confidence=result.confidence if told else 0.5,
            evidence=result.evidence + (self._details if told else ()),
            reason=reason,
        )

    def _explain(self) -> None:
        """Look at the tool for what went wrong."""
        result = self._result
        self.cause, self._details = None, ()
        if result is None or not result.judged or not self.plan.contacts:
            return
        features = impact_features(result, self.plan, self._robot)
        if len(self.plan.contacts) > 1:  # a ball tells nothing of how the surface lies
            tilt = features.inclination_deg
            text = f"the tool is tilted by {tilt:+.1f} deg against the plan"
            self._details = (Evidence("inclination", tilt, None, text),)
        if self._causes is not None:
            self.cause = cause = self._causes.tell_features(features)
            probable = f"{cause.cause} is the most probable cause, {100 * cause.confidence:.0f} %"
            self._details += (Evidence("cause", cause.confidence, None, probable), *cause.evidence)

    def _own(self, news: int, contacts: Contacts, memory: Memory) -> ContactEvent | None:
        """Return what the plan says without an event of the contacts."""
        result = self._result
        assert result is not None
        current = contacts.current
        if current is not None and self._is_planned(current, result):
            before, self._claimed = self._claimed, self._as_impact(current, result)
            same = before is not None and (before.id, before.kind) == (current.id, self._claimed.kind)
            return None if same and news != DECIDED else replace(self._claimed, phase="changed")
        if news != DECIDED:
            return None
        claimed = self._claimed
        if claimed is not None:  # it is over already
            self._claimed = self._as_impact(claimed, result)
            return self._claimed
        return self._alone(result, contacts.reserve(), memory)

    def _alone(self, result: AimAwareResult, number: int, memory: Memory) -> ContactEvent:
        assert result.decided_s is not None
        onset_s = result.impact_s[0] if result.judged else self.plan.t_d_s
        decided_s = result.decided_s
        rows = memory.recent(len(memory.history))
        before = rows[(rows["t"] > onset_s - _BEFORE_S) & (rows["t"] <= onset_s)]
        after = rows[rows["t"] > onset_s]
        force, torque = np.zeros((1, 3)), np.zeros((1, memory.n))
        if result.judged and len(before) and len(after):
            force = after["wrench"][:, :3] - before["wrench"][:, :3].mean(axis=0)
            torque = after["tau_ext"] - before["tau_ext"].mean(axis=0)
        velocity = before["twist"][:, :3].mean(axis=0) if len(before) else None
        event = ContactEvent(
            id=number,
            phase="ended",
            kind="contact",
            onset_s=onset_s,
            detected_s=onset_s if result.judged else decided_s,
            end_s=decided_s,
            link=None,
            location=None,
            directions=(),
            force_n=_floats(force[-1]),
            peak_force_n=float(np.linalg.norm(force, axis=1).max()),
            torque_ext_nm=_floats(torque[-1]),
            velocity_m_s=None if velocity is None else _floats(velocity),
            confidence=0.5,
            evidence=(Evidence("planned", None, None, "planned impact"),),
            sigma_min=None,
            damped=False,
        )
        return self._as_impact(event, result)


def _floats(values: Any) -> tuple[float, ...]:
    return tuple(float(value) for value in values)
