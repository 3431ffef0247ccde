"""What a detection becomes: a contact with a beginning, a kind, a force and an end."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tactful.classification import Classifier, Evidence, Onset, Verdict
from tactful.detection import AXES
from tactful.detection.contact_state import (
    COLLISION,
    CONTACT,
    COOPERATION,
    DECIDE,
    DETECTED,
    ENDED,
    FREE,
    NEW_DIRECTION,
    tell,
)
from tactful.dynamics.kernels import mass_matrix
from tactful.estimation._wrench import smallest_singular_value
from tactful.monitor._config import MonitorConfig
from tactful.monitor._event import ContactEvent
from tactful.monitor._kernel import LOCATE, WRENCH
from tactful.monitor._locator import BASELINE_S, SETTLED_S, Locator
from tactful.monitor._memory import Memory
from tactful.signals import onset_index

Array = NDArray[np.float64]

_STATES = {"collision": COLLISION, "cooperation": COOPERATION}
_BEFORE_S = 0.02
"""Time over which what was before a contact is averaged [s]."""
_GUARD_S = 0.08
"""How long before the onset that time ends: the onset of a slow push is set where it has already risen a little [s]."""
_AFTER_S = 1.0
"""How long after a collision the arm is likely to touch the same thing again [s]."""
_MARGIN_S = 0.2
"""How much longer than one and a half of the window that told it a contact may be there in fast mode [s]."""
_PRIOR = np.array([20.0, 20.0, 20.0, 4.0, 4.0, 4.0]) ** 2
"""Variance of the wrench of a touch at the tip, where the noise of the torque is known [N^2, (Nm)^2]."""


@dataclass(frozen=True, eq=False, slots=True)
class _Detection:
    """A contact between its detection and its classification."""

    onset_s: float
    detected_s: float
    before: Any  # the mean row before the onset
    directions: tuple[str, ...]
    sigma_min: float | None
    damped: bool


class Contacts:
    """The contacts of a monitor: at most one at a time, told when it begins, changes and ends.

    Args:
        memory: the monitor's memory, which the kernel fills.
        config: the settings.
        classifier: what tells the kind of a contact.
        locator: what tells where it is, if that can be told.
    """

    def __init__(
        self, memory: Memory, config: MonitorConfig, classifier: Classifier, locator: Locator | None = None
    ) -> None:
        self.current: ContactEvent | None = None
        self.waiting: deque[ContactEvent] = deque()
        self._memory, self._config, self._classifier, self._locator = memory, config, classifier, locator
        self._count = 0
        self._free_since_s = self._collision_until_s = -np.inf
        self._undecided: _Detection | None = None
        self._decided: tuple[Evidence, ...] = ()  # what made the contact what it is

    @property
    def state(self) -> int:
        """The state of the contact in the memory."""
        return int(self._contact["state"])

    @property
    def _contact(self) -> Any:
        return self._memory.record[0]["contact"]

    def reserve(self) -> int:
        """Return the number of an event that is not a contact's."""
        self._count += 1
        return self._count - 1

    def next(self) -> ContactEvent | None:
        """Return an event that had to wait for a sample of its own."""
        return self.waiting.popleft() if self.waiting else None

    def open(self) -> Iterator[ContactEvent]:
        """Yield what is known at the end of a recording: what waits, and the contact that lasts."""
        yield from self.waiting
        if self.current is not None:
            yield replace(self.current, peak_force_n=self._peak())

    def react(self, code: int) -> ContactEvent | None:
        """Tell what a sample brought."""
        if code == LOCATE:
            located = self._located()
            if located is not None:
                self.waiting.append(located)
            return self.next()
        if code == DETECTED:
            return self._detected()
        if code == NEW_DIRECTION:
            return self._new_direction()
        if code == DECIDE:
            return self._decide()
        ago = int(self._contact["ended_ago"]) if code == ENDED else 1
        end_s = float(self._memory.recent(ago + 1)["t"][0])
        ended = self._ended(end_s)
        if ended.kind == "collision":
            self._collision_until_s = end_s
        self.current, self._undecided = None, None
        self._free_since_s = end_s
        return ended

    def _located(self) -> ContactEvent | None:
        """Look where the contact is; tell it when that is another link than was thought."""
        assert self.current is not None
        thought = self.current.link
        self._locate()
        if self.current.link in (None, thought):
            return None
        self.current = replace(self.current, phase="changed", peak_force_n=self._peak())
        return self.current

    def _locate(self) -> None:
        assert self.current is not None
        if self._locator is None:
            return
        age_s = float(self._memory.sample["t"][0]) - self.current.onset_s
        location = self._locator.look(age_s)
        if location is not None:
            sure = age_s >= SETTLED_S and not location.ambiguous and not location.several
            self.current = replace(self.current, location=location, link=location.link if sure else None)

    def _detected(self) -> ContactEvent:
        onset = self._onset()
        detection = self._detection(onset)
        contact = self._contact
        contact["free"] = detection.before["signal"]
        if contact["decide"]:
            contact["countdown"] = contact["decide"]
            self._undecided = detection
            verdict = Verdict("contact", 0.5, ())
        else:
            verdict = self._classifier.classify(onset)
        return self._begin(onset, detection, verdict)

    def _new_direction(self) -> ContactEvent | None:
        onset = self._onset()
        detection = self._detection(onset)
        contact, current = self._contact, self.current
        assert current is not None
        if detection.onset_s - current.onset_s <= self._config.contact.merge_s:
            return self._grow(detection.directions) if self.state == COLLISION else None
        if contact["decide"]:
            contact["countdown"] = contact["decide"]
            contact["active"] |= contact["pending"]
            self._undecided = detection
            return None
        return self._told(onset, detection, self._classifier.classify(onset))

    def _decide(self) -> ContactEvent | None:
        detection = self._undecided
        assert detection is not None
        onset = self._onset(detection)
        verdict = self._classifier.classify(onset)
        if verdict.kind == "contact" and onset.next_s is not None:
            self._contact["countdown"] = self._contact["decide"]
            return None
        self._undecided = None
        if self.state == COLLISION:
            return self._told(onset, detection, verdict)
        if self.state == COOPERATION:
            return self._told_in_cooperation(onset, detection, verdict)
        assert self.current is not None
        tell(self._contact, _STATES.get(verdict.kind, CONTACT))
        self._decided = verdict.evidence
        self.current = replace(
            self.current,
            phase="changed",
            kind=verdict.kind,
            confidence=verdict.confidence,
            evidence=verdict.evidence,
            directions=_directions(onset),
            force_n=_floats(onset.force_n[-1] - detection.before["wrench"][:3]),
            torque_ext_nm=_floats(self._torque(onset, detection.before)),
            peak_force_n=self._peak(),
        )
        self._locate()
        return self.current

    def _told(self, onset: Onset, detection: _Detection, verdict: Verdict) -> ContactEvent | None:
        """Take the verdict on what came during a collision: another contact replaces it, or it goes on."""
        if verdict.kind == "cooperation":
            self.waiting.append(self._ended(detection.onset_s))
            self._collision_until_s = detection.onset_s
            return self._begin(onset, detection, verdict)
        return self._grow(detection.directions, verdict)

    def _told_in_cooperation(self, onset: Onset, detection: _Detection, verdict: Verdict) -> ContactEvent | None:
        """Take the verdict on what came during a cooperation: a collision replaces it, or the hand goes on."""
        self._contact["pending"] = 0
        if verdict.kind != "collision" or verdict.confidence < self._config.learned.sure:
            return None
        self.waiting.append(self._ended(detection.onset_s))
        return self._begin(onset, detection, verdict)

    def _grow(self, directions: tuple[str, ...], verdict: Verdict | None = None) -> ContactEvent | None:
        """Take more of the same collision; return None where that says nothing new."""
        current = self.current
        assert current is not None
        tell(self._contact, COLLISION)
        both = tuple(axis for axis in AXES if axis in current.directions or axis in directions)
        if verdict is None and both == current.directions:
            return None
        self.current = replace(
            current,
            phase="changed",
            directions=both,
            peak_force_n=self._peak(),
            evidence=self._decided + verdict.evidence if verdict else current.evidence,
        )
        return self.current

    def _begin(self, onset: Onset, detection: _Detection, verdict: Verdict) -> ContactEvent:
        contact, before = self._contact, detection.before
        contact["before"] = before["signal"]
        contact["force_before"] = before["wrench"][:3]
        force = onset.force_n[-1] - before["wrench"][:3]
        contact["peak"] = float(np.linalg.norm(force))
        tell(contact, _STATES.get(verdict.kind, CONTACT))
        self._decided = verdict.evidence
        velocity = onset.velocity_before_m_s(_BEFORE_S)
        if self._locator is not None:
            self._locator.begin(before["bias"], second=onset.in_collision)
        self.current = ContactEvent(
            id=self._count,
            phase="began",
            kind=verdict.kind,
            onset_s=detection.onset_s,
            detected_s=detection.detected_s,
            end_s=None,
            link=None,
            location=None,
            directions=detection.directions,
            force_n=_floats(force),
            peak_force_n=float(np.linalg.norm(force)),
            torque_ext_nm=_floats(self._torque(onset, before)),
            velocity_m_s=None if velocity is None else _floats(velocity),
            confidence=verdict.confidence,
            evidence=verdict.evidence,
            sigma_min=detection.sigma_min,
            damped=detection.damped,
        )
        self._count += 1
        self._locate()
        return self.current

    def _ended(self, end_s: float) -> ContactEvent:
        assert self.current is not None
        return replace(self.current, phase="ended", end_s=end_s, peak_force_n=self._peak())

    def _peak(self) -> float:
        assert self.current is not None
        return max(self.current.peak_force_n, float(self._contact["peak"]))

    def _torque(self, onset: Onset, before: Any) -> Array:
        if onset.tau_ext_nm is None:
            return np.zeros(0)
        return np.asarray(onset.tau_ext_nm[-1] - before["tau_ext"])

    def _detection(self, onset: Onset) -> _Detection:
        record = self._memory.record[0]
        sample = self._memory.sample[0]
        placed = bool(sample["has_q"])
        count, guard = (round(span_s * self._config.rate_hz) for span_s in (_BEFORE_S, _GUARD_S))
        last = max(0, onset.index - guard)
        before = self._rows()[: last + 1]
        rows = before[-max(1, count) :]
        bias = before["tau_ext"][-max(1, round(BASELINE_S * self._config.rate_hz)) :].mean(axis=0)
        return _Detection(
            onset_s=float(onset.t[onset.index]),
            detected_s=float(onset.t[-1]),
            before={name: rows[name].mean(axis=0) for name in ("wrench", "tau_ext", "signal")} | {"bias": bias},
            directions=_directions(onset),
            sigma_min=smallest_singular_value(record["J"]) if placed else None,
            damped=placed and sample["source"] != WRENCH and bool(record["wrench"]["damped"]),
        )

    def _rows(self) -> Any:
        """Return the rows in which a contact that was detected now may have begun."""
        count = round(self._config.contact.search_s * self._config.rate_hz)
        rows = self._memory.recent(min(count, int(self._memory.record[0]["since_start"])))
        after = rows["t"] > self._free_since_s
        return rows[after] if self.state == FREE and after.sum() >= 3 else rows

    def _onset(self, detection: _Detection | None = None) -> Onset:
        """Return what is known of the contact that was detected now, or before."""
        record, sample = self._memory.record[0], self._memory.sample[0]
        contact = record["contact"]
        rows = self._rows()
        force = rows["wrench"][:, :3]
        fast = bool(record["fast"])
        change = covariance = None
        if fast:
            glr = record["glr"]
            best = int(glr["best"])
            change = glr["y"][best].copy()
            L = np.tril(glr["L"][best])
            L[np.diag_indices_from(L)] = 1 / np.diag(L)
            covariance = L @ L.T
            source = rows["wrench"] if sample["source"] == WRENCH else rows["tau_ext"]
            rise = source @ np.linalg.solve(covariance, change)
            begin = max(0, len(rise) - round(1.5 * glr["length"][best] + _MARGIN_S * self._config.rate_hz))
            directions = np.zeros(len(AXES), dtype=bool)
        else:
            directions = np.array([bool(int(contact["pending"]) >> i & 1) for i in range(len(AXES))])
            ratio = np.where(directions, rows["level"][-1] / contact["threshold"], 0.0)
            rise = force[:, int(np.argmax(ratio))]
            begin = 0
        if detection is None:
            index = begin + onset_index(rise[begin:], fraction=self._config.contact.onset_fraction)
        else:
            index = max(0, int(np.searchsorted(rows["t"], detection.onset_s)))
        change_n = None if change is None or covariance is None else self._wrench_of(change, covariance)
        if change_n is not None:
            directions = np.abs(change_n) >= 0.5 * np.linalg.norm(change_n)
        placed = bool(sample["has_q"])
        collided = bool(contact["state"] == COLLISION)
        return Onset(
            rate_hz=self._config.rate_hz,
            t=rows["t"],
            force_n=force,
            moment_nm=rows["wrench"][:, 3:],
            velocity_m_s=rows["twist"][:, :3] if sample["has_dq"] else None,
            tau_ext_nm=None if sample["source"] == WRENCH else rows["tau_ext"],
            index=min(index, len(rows) - 1),
            directions=directions,
            in_collision=collided,
            after_collision=collided
            or float(rows["t"][min(index, len(rows) - 1)]) - self._collision_until_s < _AFTER_S,
            torque_change_nm=change,
            mean_force_change_n=change_n,
            torque_covariance_nm2=covariance,
            detected_s=float(rows["t"][-1]) if detection is None else detection.detected_s,
            next_s=self._next_s(float(rows["t"][-1]), detection),
            q_rad=rows["q"] if placed else None,
            jacobian=record["J"].copy() if placed else None,
            mass_matrix=self._mass_matrix() if placed else None,
            collision_torque_nm=record["glr"]["known"].copy() if fast and collided else None,
            collision_s=self.current.onset_s if collided and self.current is not None else None,
            location=self._locator.found if self._locator and detection and not collided else None,
        )

    def _next_s(self, t: float, detection: _Detection | None) -> float | None:
        """Return when the classifier is asked again if it cannot tell at the time t [s]."""
        fast = self._config.fast
        if detection is None or t - detection.detected_s >= fast.decide_until_s:
            return None
        return t + float(self._contact["decide"]) / self._config.rate_hz

    def _mass_matrix(self) -> Array:
        record = self._memory.record[0]
        M = np.empty((self._memory.n, self._memory.n))
        mass_matrix(record["arm"], record["motion"], M)
        return M

    def _wrench_of(self, change: Array, covariance: Array) -> Array:
        """Return the force (3,) at the tip that a change of the channels means, by the prior on a touch.

        F = P J (J^T P J + V)^-1 y: the mean of the posterior, which stays finite at singularities [N].
        """
        if self._memory.sample[0]["source"] == WRENCH:
            return change[:3].copy()
        J = self._memory.record[0]["J"]
        PJ = _PRIOR[:, None] * J
        return np.asarray(PJ @ np.linalg.solve(J.T @ PJ + covariance, change))[:3]


def _directions(onset: Onset) -> tuple[str, ...]:
    return tuple(axis for axis, there in zip(AXES, onset.directions, strict=True) if there)


def _floats(values: Any) -> tuple[float, ...]:
    return tuple(float(value) for value in values)
