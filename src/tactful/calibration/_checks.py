"""What is wrong with recordings, and what a motion leaves open."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from tactful.calibration._columns import Columns
from tactful.calibration._errors import CalibrationError
from tactful.calibration._fit import Fit
from tactful.calibration._motion import MOVING_RAD_S, Stretch
from tactful.dynamics import Dynamics
from tactful.errors import TactfulError
from tactful.monitor import MonitorConfig
from tactful.recordings import Recording
from tactful.robots import Robot

Array = NDArray[np.float64]
Source = Literal["tau", "tau_ext", "wrench"]

SHORTEST_S = 2.0
"""Least time in motion that is calibrated from [s]."""
_CONTACT = 7.0
"""Residual, in its usual sizes, that is taken for a contact."""
_CONTACT_S = 0.08
_GRAVITY = (0.5, 2.0)
"""Measured torque per modelled gravity torque that a payload may make."""
_GRAVITY_NM = 1.0
_GRAVITY_ROWS = 400
_UNEXPLAINED = 0.15
"""Share of the changes of the torque that the fit leaves of another arm, at least: the motion of a Panda leaves 2 %, of
a UR10e by its currents 8 %, of a Panda that is taken for an iiwa 16 to 62 %."""


def source_of(recordings: Sequence[Recording], config: MonitorConfig) -> Source:
    """Return what the recordings are calibrated by.

    Raises:
        CalibrationError: if a recording has nothing to calibrate from, or another rate than the first.
    """
    needs: dict[Source, tuple[str, ...]] = {
        "tau": ("q", "dq", "tau"),
        "tau_ext": ("q", "tau_ext"),
        "wrench": ("wrench",),
    }
    possible: tuple[Source, ...] = tuple(needs) if config.source == "auto" else (config.source,)
    for source in possible:
        if all(channel in recording.channels for recording in recordings for channel in needs[source]):
            break
    else:
        first = next(r for r in recordings if any(channel not in r.channels for channel in needs[possible[0]]))
        lacking = [channel for channel in needs[possible[0]] if channel not in first.channels]
        raise CalibrationError(
            first.source or "recording",
            f"lacks {', '.join(lacking)}: a calibration needs {', or '.join(' '.join(needs[s]) for s in possible)}",
        )
    for recording in recordings:
        if abs(recording.rate_hz / recordings[0].rate_hz - 1) > 0.05:
            raise CalibrationError(
                recording.source or "recording",
                f"sampled at {recording.rate_hz:.4g} Hz, but {recordings[0].source} at {recordings[0].rate_hz:.4g} Hz: "
                "calibrate recordings of one rate at a time",
            )
    if source != "wrench" and config.robot.model is None:
        raise TactfulError(
            f"{recordings[0].source or 'recording'}: which arm was recorded? Name it: --robot or config.robot.model, "
            "one of `tactful robots`, or an MJCF or URDF file"
        )
    return source


def check_motion(stretches: Sequence[Stretch], source: str) -> None:
    """Check that the arm moves, for long enough.

    Raises:
        CalibrationError: if it does not.
    """
    total = moving = 0.0
    fastest = 0.0
    for stretch in stretches:
        speed = np.abs(stretch.dq).max(axis=1)
        total += stretch.duration_s
        moving += float(np.mean(speed > MOVING_RAD_S)) * stretch.duration_s
        fastest = max(fastest, float(np.quantile(speed, 0.99)))
    if total < SHORTEST_S:
        raise CalibrationError(source, f"{total:.3g} s are too short: a calibration needs {SHORTEST_S:g} s of motion")
    if moving < SHORTEST_S:
        raise CalibrationError(
            source,
            f"the arm stands still: it moves for {moving:.2g} of {total:.3g} s, at most at {fastest:.2g} rad/s; record "
            f"free motion of all joints for {SHORTEST_S:g} s or more",
        )


def check_gravity(stretches: Sequence[Stretch], robot: Robot, source: str) -> None:
    """Check that the torque follows the gravity of the arm.

    Raises:
        CalibrationError: if it is of another arm, or of one that is mounted otherwise.
    """
    dq = np.concatenate([stretch.dq for stretch in stretches])
    tau = np.concatenate([stretch.tau for stretch in stretches])
    rows, g = _gravity(stretches, robot)
    spread = g.std(axis=0)
    if not (spread > _GRAVITY_NM).any():
        return
    share, weight = [], []
    for i in np.flatnonzero(spread > _GRAVITY_NM):
        B = np.stack([g[:, i], np.ones(len(rows)), dq[rows, i], np.tanh(dq[rows, i] / 0.02)], axis=1)
        share.append(np.linalg.lstsq(B, tau[rows, i], rcond=None)[0][0])
        weight.append(spread[i] ** 2)
    ratio = float(np.average(share, weights=weight))
    if not _GRAVITY[0] <= ratio <= _GRAVITY[1]:
        raise CalibrationError(
            source,
            f"the torque is not that of {robot.name}: from pose to pose it changes by {ratio:.2f} of what gravity asks "
            "for; choose the robot, its mounting and the sign of the torque as they were recorded",
        )


def _gravity(stretches: Sequence[Stretch], robot: Robot) -> tuple[NDArray[np.intp], Array]:
    """Return some rows of the motion (k,), and the torque that gravity asks for in them (k, n) [Nm]."""
    dynamics = Dynamics(robot)
    q = np.concatenate([stretch.q for stretch in stretches])
    rows = np.linspace(0, len(q) - 1, min(len(q), _GRAVITY_ROWS)).astype(np.intp)
    return rows, np.array([dynamics.gravity(x) for x in q[rows]])


def check_explained(fit: Fit, stretches: Sequence[Stretch], robot: Robot, source: str) -> None:
    """Check that the calibrated arm explains the torque, of joints that gravity loads: the others may be all friction.

    Raises:
        CalibrationError: if it is of another arm.
    """
    changes = np.concatenate([stretch.tau for stretch in stretches]).std(axis=0)
    loaded = _gravity(stretches, robot)[1].std(axis=0) > _GRAVITY_NM
    left = np.sqrt(np.mean(fit.residual**2, axis=0))  # (n,)
    share = float(np.linalg.norm(left[loaded]) / np.linalg.norm(changes[loaded])) if loaded.any() else 0.0
    if share > _UNEXPLAINED:
        raise CalibrationError(
            source,
            f"the torque is not that of {robot.name}: {share:.0%} of its changes are left after the fit; choose the "
            "robot and its mounting as they were recorded",
        )


def check_contact(columns: Columns, fit: Fit, stretches: Sequence[Stretch]) -> None:
    """Check that nothing touched the arm.

    Raises:
        CalibrationError: if something did; it says where and when.
    """
    size = np.maximum(fit.size, 0.02 * np.abs(columns.r).max(axis=0))
    far = np.abs(fit.residual) / size  # (k, n)
    over = far.max(axis=1) > _CONTACT
    times: list[tuple[str, float, float, int]] = []
    for number, stretch in enumerate(stretches):
        rows = np.flatnonzero(columns.stretch == number)
        hits = rows[over[rows]]
        if not len(hits):
            continue
        for run in np.split(hits, np.flatnonzero(np.diff(hits) > 0.3 * columns.rate_hz) + 1):
            start, end = float(columns.t[run[0]]), float(columns.t[run[-1]])
            if end - start >= _CONTACT_S:
                times.append((stretch.source, start, end, int(np.argmax(far[run].max(axis=0)))))
    if times:
        source, start, end, joint = times[0]
        more = f", and {len(times) - 1} more" if len(times) > 1 else ""
        raise CalibrationError(
            source,
            f"something touches the arm from {start:.2f} to {end:.2f} s (at {fit.robot.joint_names[joint]}){more}: "
            "calibrate from motion without contact, or cut that time out",
        )


def not_excited(stretches: Sequence[Stretch], robot: Robot) -> tuple[str, ...]:
    """Return what the motion says nothing about, a sentence each."""
    dq = np.concatenate([stretch.dq for stretch in stretches])
    fastest = np.quantile(np.abs(dq), 0.995, axis=0)
    sentences = []
    for i, name in enumerate(robot.joint_names):
        if fastest[i] < MOVING_RAD_S:
            sentences.append(
                f"{name} does not move: its friction, and the inertia that it alone moves, keep their nominal figures"
            )
            continue
        signs = np.sign(dq[np.abs(dq[:, i]) > MOVING_RAD_S, i])
        if np.sum(np.diff(signs) != 0) < 1:
            sentences.append(f"{name} never reverses: its Coulomb friction cannot be told from a bias")
        limit = robot.velocity_limit[i]
        if np.isfinite(limit) and fastest[i] < 0.8 * limit:
            sentences.append(
                f"{name} moves at up to {fastest[i]:.2f} rad/s, {fastest[i] / limit:.0%} of its limit: nothing is "
                "known of faster motion"
            )
    return tuple(sentences)
