"""Calibration from the robot's own external torque, or a wrench: bias, noise and what counts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from tactful.calibration._errors import CalibrationError
from tactful.calibration._motion import MOVING_RAD_S, gap_free
from tactful.calibration._noise import FreeTorque
from tactful.estimation import ObserverConfig
from tactful.recordings import Recording
from tactful.robots import Robot

Array = NDArray[np.float64]
External = Literal["tau_ext", "wrench"]

_SHORTEST_S = 3.0
_SETTLING_S = 1.0
_SLOW_HZ = 8.0
_CONTACT = 12.0
"""Distance of the slow torque from its median, in its usual ones, that is taken for a contact."""
_CONTACT_S = 0.08
_BLOCK_S = 0.5
_RELAXING = (0.125, 0.125, 0.125, 0.025, 0.025, 0.025)
"""By how much a wrench estimated by an arm at rest changes after a touch: friction holds some of it [N, Nm]."""


@dataclass(frozen=True, eq=False)
class Quiet:
    """A recording without a gap in which nothing touches the arm, that is not fitted to."""

    recording: Recording
    robot: Robot | None
    observer: ObserverConfig

    def counts(self, settling_s: float) -> NDArray[np.bool_]:
        """Return which samples count for something that settles in `settling_s` (k,)."""
        t = self.recording.t
        return np.asarray(t >= t[0] + settling_s)

    def torque(self, source: External) -> FreeTorque:
        """Return the external torque, or wrench: without a velocity, as the detector takes it."""
        x = self.recording.channels[source]
        m = x.shape[1]
        unsure = np.zeros((2, m))
        if source == "wrench":
            unsure[0] = _RELAXING
        return FreeTorque(x, np.zeros_like(x), self.counts(_SETTLING_S), np.zeros((m, m)), unsure)


def quiet_parts(
    recordings: Sequence[Recording], robot: Robot | None, observer: ObserverConfig, source: External
) -> list[Quiet]:
    """Return what of the recordings can be used.

    Raises:
        CalibrationError: if they are too short, of an arm with another number of joints, or hold contact.
    """
    parts = []
    for recording in recordings:
        width = recording.channels[source].shape[1]
        if source == "tau_ext" and robot is not None and width != robot.n:
            raise CalibrationError(
                recording.source or "recording",
                f"has {width} joints, but {robot.name} has {robot.n}: choose the robot it was taken of",
            )
        channels = [name for name in ("q", "dq", source) if name in recording.channels]
        if source == "wrench" and robot is None:
            channels = ["wrench"]
        for rows in gap_free(recording, channels):
            values = {name: recording.channels[name][rows] for name in channels}
            parts.append(Quiet(Recording(recording.t[rows], values, source=recording.source), robot, observer))
    name = recordings[0].source or "recording"
    total_s = sum(part.recording.duration_s for part in parts)
    if total_s < _SHORTEST_S:
        raise CalibrationError(
            name, f"{total_s:.3g} s without a gap are too short: a calibration needs {_SHORTEST_S:g} s"
        )
    for part in parts:
        _check_contact(part, source)
    return parts


def still(parts: Sequence[Quiet]) -> tuple[str, ...]:
    """Return what the recordings say nothing about."""
    speeds = [np.abs(part.recording.dq).max() for part in parts if part.recording.dq is not None]
    if speeds and max(speeds) > MOVING_RAD_S:
        return ()
    known = "the arm stands still" if speeds else "it is not recorded whether the arm moves"
    return (f"{known}: the noise of motion is not in the thresholds",)


def rms(parts: Sequence[Quiet], source: External) -> tuple[Array, Array]:
    """Return the mean (m,) and the RMS about it (m,) of the torque or wrench."""
    x = np.concatenate([part.recording.channels[source] for part in parts])
    return x.mean(axis=0), x.std(axis=0)


def _check_contact(part: Quiet, source: External) -> None:
    """Check that nothing touched the arm.

    The usual size of the torque is that within the quieter half of short blocks: a push that lasts is no measure of it.
    """
    recording = part.recording
    x = recording.channels[source]
    gain = 1 - np.exp(-2 * np.pi * _SLOW_HZ / recording.rate_hz)
    slow, _ = lfilter([gain], [1, gain - 1], x, axis=0, zi=(1 - gain) * np.median(x[:5], axis=0)[None])
    block = max(2, round(_BLOCK_S * recording.rate_hz))
    blocks = [slow[k : k + block] for k in range(0, len(slow) - block + 1, block)]
    spread = np.array([np.ptp(values, axis=0) for values in blocks])  # (b, m)
    quiet = [blocks[k] for k in np.argsort(_rank(spread))[: max(2, len(blocks) // 2)]]
    nearest = sorted(quiet, key=lambda values: float(np.linalg.norm(values.mean(axis=0))))[: max(1, len(quiet) // 3)]
    centre = np.median(np.concatenate(nearest), axis=0)
    size = np.sqrt(np.mean([values.var(axis=0) for values in quiet], axis=0)) + 1e-3 * np.abs(x - centre).max()
    far = np.abs(slow - centre) / size  # (k, m)
    over = np.flatnonzero(far.max(axis=1) > _CONTACT)
    for run in np.split(over, np.flatnonzero(np.diff(over) > 0.3 * recording.rate_hz) + 1):
        if len(run) and recording.t[run[-1]] - recording.t[run[0]] >= _CONTACT_S:
            start, end = recording.t[run[0]], recording.t[run[-1]]
            raise CalibrationError(
                recording.source or "recording",
                f"something touches the arm from {start:.2f} to {end:.2f} s (by {source}): calibrate from time without "
                "contact, or cut that time out",
            )


def _rank(spread: Array) -> Array:
    """Return how restless each block is (b,): the largest of its spreads, each in the usual one of its channel."""
    return np.asarray((spread / (np.median(spread, axis=0) + 1e-9)).max(axis=1))
