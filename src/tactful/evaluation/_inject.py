"""Contacts injected into the signals of a real arm."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tactful.dynamics import Dynamics
from tactful.estimation import WrenchConfig, external_wrench
from tactful.evaluation._errors import EvaluationError
from tactful.evaluation._labels import VISIBLE_N
from tactful.recordings import Label, Recording
from tactful.robots import Frame, Robot

Array = NDArray[np.float64]
_CHANNELS = ("tau", "tau_ext", "wrench")
_LONGEST_STALE = 5
"""How many equal rows in succession may be one sample that was logged again."""
_UNDAMPED = WrenchConfig(damped_below=0.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class InjectedContact:
    """A force on the arm, in base axes.

    An impact is a half sine, F sin(pi (t - start_s) / (end_s - start_s)). A push rises to F along half a cosine within
    `rise_s`, stays, and falls as it rose.

    Attributes:
        kind: its course in time.
        start_s: when it begins [s].
        end_s: when it is over [s].
        force_n: F, its peak (3,) [N].
        link: index of the link; None is the tip of the robot.
        point_m: where the force acts (3,), in the link's frame [m]; not used at the tip.
        rise_s: time in which a push rises, and at most half of its duration [s].

    Raises:
        EvaluationError: a number is not finite, or the contact ends before it begins.
    """

    kind: Literal["impact", "push"]
    start_s: float
    end_s: float
    force_n: tuple[float, float, float]
    link: int | None = None
    point_m: tuple[float, float, float] = (0.0, 0.0, 0.0)
    rise_s: float = 0.2

    def __post_init__(self) -> None:
        if not np.isfinite([self.start_s, self.end_s, self.rise_s, *self.force_n, *self.point_m]).all():
            raise EvaluationError(f"the {self.kind} at {self.start_s} s has a number that is not finite")
        if not self.start_s < self.end_s:
            raise EvaluationError(
                f"the {self.kind} at {self.start_s:g} s is over at {self.end_s:g} s: give it some time"
            )

    @property
    def peak_force_n(self) -> float:
        """Magnitude of the force at its peak [N]."""
        return math.hypot(*self.force_n)

    @property
    def visible_s(self) -> float | None:
        """When the force passes 1 N [s]; None if it does not."""
        ratio = VISIBLE_N / self.peak_force_n if self.peak_force_n > VISIBLE_N else None
        if ratio is None:
            return None
        if self.kind == "impact":
            return self.start_s + (self.end_s - self.start_s) / math.pi * math.asin(ratio)
        return self.start_s + self._rise_s / math.pi * math.acos(1 - 2 * ratio)

    @property
    def _rise_s(self) -> float:
        return min(self.rise_s, (self.end_s - self.start_s) / 2)

    def force_at(self, t: ArrayLike) -> Array:
        """Return the force (k, 3) at the times t (k,) [s], zero outside of the contact [N]."""
        time = np.asarray(t, dtype=np.float64)
        since, left = time - self.start_s, self.end_s - time  # (k,)
        if self.kind == "impact":
            share = np.sin(np.pi * np.clip(since / (self.end_s - self.start_s), 0, 1))
        else:
            share = (1 - np.cos(np.pi * np.clip(np.minimum(since, left) / self._rise_s, 0, 1))) / 2
        share = np.where((since >= 0) & (left >= 0), share, 0.0)
        force: Array = share[:, None] * np.asarray(self.force_n)  # (k, 3)
        return force

    def label(self) -> Label:
        """The contact as the truth of a recording."""
        return Label(
            self.kind,
            self.start_s,
            self.end_s,
            self.link,
            visible_s=self.visible_s,
            peak_force_n=self.peak_force_n,
        )


def inject(recording: Recording, robot: Robot | None, contacts: Iterable[InjectedContact]) -> Recording:
    """Return a recording as it would be had forces acted on the arm and its motion been the same.

    From M qdd + C qd + g = tau + tau_ext and the same motion, a force F at a point with the linear Jacobian J changes

        tau by -J^T F,    tau_ext by J^T F,    wrench by the wrench at the tip that explains J^T F.

    That holds for a stiffly controlled arm; a compliant one would give way. The channels of a force/torque sensor and
    of the motor currents stay as they are. A row that repeats the one before it, since the robot logged a stale sample,
    repeats it still.

    Args:
        recording: what was measured. Without joint positions, contacts can act at the tip only, through its `jacobian`
            where there are torques.
        robot: the arm; not needed for contacts at the tip of a recording without joint positions.
        contacts: what acts; several at once add up.

    Returns:
        The recording with the labels of the contacts added.

    Raises:
        EvaluationError: the recording has no channel that shows a force, or not what a contact needs; a contact lies
            outside of it, or on a link that is not there.
    """
    forces = list(contacts)
    shown = [name for name in _CHANNELS if name in recording.channels]
    if not shown:
        raise EvaluationError(
            f"none of its channels ({', '.join(recording.channels)}) shows a force: it needs {' or '.join(_CHANNELS)}",
            source=recording.source,
        )
    first_s, last_s = float(np.nanmin(recording.t)), float(np.nanmax(recording.t))
    torque = np.zeros((len(recording), recording.n_joints or 0))  # J^T F, (N, n)
    wrench = np.zeros((len(recording), 6))  # at the tip
    for contact in forces:
        if contact.start_s < first_s or contact.end_s > last_s:
            raise EvaluationError(
                f"the {contact.kind} from {contact.start_s:g} to {contact.end_s:g} s lies outside the recording, "
                f"which spans {first_s:g} to {last_s:g} s",
                source=recording.source,
            )
        rows = np.flatnonzero((recording.t >= contact.start_s) & (recording.t <= contact.end_s))
        force = contact.force_at(recording.t[rows])  # (k, 3)
        if robot is None or recording.q is None:
            _act_at_tip(recording, contact, rows, force, torque, wrench)
        else:
            _act(recording, robot, contact, rows, force, torque, wrench)
    _repeat_stale_rows(recording, torque, wrench)
    changes = {"tau": -torque, "tau_ext": torque, "wrench": wrench}
    changed = recording.with_channels(**{name: recording.channels[name] + changes[name] for name in shown})
    labels = sorted((*recording.labels, *(contact.label() for contact in forces)), key=lambda label: label.start_s)
    note = f"{len(forces)} contact{'s' * (len(forces) != 1)} injected"
    return replace(changed, labels=tuple(labels), notes=(*recording.notes, note))


def _act(
    recording: Recording,
    robot: Robot,
    contact: InjectedContact,
    rows: NDArray[np.intp],
    force: Array,
    torque: Array,
    wrench: Array,
) -> None:
    """Let a force (k, 3) act on an arm whose posture is known."""
    q = recording.channels["q"]
    if q.shape[1] != robot.n:
        raise EvaluationError(
            f"q has {q.shape[1]} columns, but {robot.name} has {robot.n} joints: choose the robot that was recorded",
            source=recording.source,
        )
    tip = Dynamics(robot)
    touched = Dynamics(_with_tip_at(robot, contact, recording.source))
    for k, F in zip(rows, force, strict=True):
        if not np.isfinite(q[k]).all():
            continue
        change = touched.jacobian(q[k])[:3].T @ F  # (n,)
        torque[k] += change
        if recording.wrench is not None:
            explained = external_wrench(tip.jacobian(q[k]), change, _UNDAMPED)
            wrench[k] += (*explained.force_n, *explained.moment_nm)


def _with_tip_at(robot: Robot, contact: InjectedContact, source: str) -> Robot:
    """Return the arm with its tip where a contact is."""
    if contact.link is None:
        return robot
    if not 0 <= contact.link < robot.n:
        raise EvaluationError(
            f"a {contact.kind} acts on link {contact.link}, but {robot.name} has links 0 to {robot.n - 1}",
            source=source,
        )
    frame = Frame(contact.link, np.eye(3), np.asarray(contact.point_m))
    return replace(robot, frames={**robot.frames, "contact": frame}, tip="contact")


def _act_at_tip(
    recording: Recording,
    contact: InjectedContact,
    rows: NDArray[np.intp],
    force: Array,
    torque: Array,
    wrench: Array,
) -> None:
    """Let a force (k, 3) act on an arm whose posture is not known."""
    if contact.link is not None:
        raise EvaluationError(
            f"a {contact.kind} on link {contact.link} needs q and a robot: without them, contacts act at the tip",
            source=recording.source,
        )
    wrench[rows, :3] += force
    if recording.tau is None and recording.tau_ext is None:
        return
    jacobian = recording.channels.get("jacobian")
    if jacobian is None:
        raise EvaluationError(
            "joint torques show a force through the Jacobian: give q and a robot, or the channel jacobian",
            source=recording.source,
        )
    J = jacobian[rows].reshape(len(rows), 6, -1)[:, :3]  # (k, 3, n)
    torque[rows] += np.einsum("kin,ki->kn", J, force)


def _repeat_stale_rows(recording: Recording, *changes: Array) -> None:
    """Give every row that repeats the one before it, in all channels, the change of that one.

    A longer stretch of equal rows is an arm at rest without noise, as in a simulation.
    """
    values = np.concatenate(list(recording.channels.values()), axis=1)  # (N, all)
    fresh = np.concatenate([[True], (values[1:] != values[:-1]).any(axis=1)])  # (N,)
    stretch = np.cumsum(fresh) - 1  # (N,) number of the stretch of equal rows
    first = np.flatnonzero(fresh)[stretch]
    rows = np.arange(len(values))
    source = np.where(np.bincount(stretch)[stretch] <= _LONGEST_STALE, first, rows)
    for change in changes:
        change[:] = change[source]
