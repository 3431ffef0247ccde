"""Recorded motion as stretches of clean samples, with the clock and the velocity that suit it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tactful.calibration._errors import CalibrationError
from tactful.estimation import MomentumObserver, ObserverConfig
from tactful.recordings import Recording
from tactful.robots import Robot

Array = NDArray[np.float64]

MOVING_RAD_S = 0.05
"""A joint moves when it is faster than this [rad/s]."""
_SHORTEST_S = 1.0
"""Shorter stretches between two gaps are left out [s]."""


@dataclass(frozen=True, eq=False)
class Stretch:
    """Samples without a gap: t (k,) [s], q, dq and tau (k, n), and the recording that they are from."""

    t: Array
    q: Array
    dq: Array
    tau: Array
    source: str

    def __len__(self) -> int:
        return len(self.t)

    @property
    def duration_s(self) -> float:
        """Its length [s]."""
        return float(self.t[-1] - self.t[0])

    def cut(self, start: int, stop: int) -> Stretch:
        """Return the samples from `start` on, up to `stop`."""
        rows = slice(start, stop)
        return Stretch(self.t[rows], self.q[rows], self.dq[rows], self.tau[rows], self.source)


@dataclass(frozen=True, eq=False)
class HeldOut:
    """A stretch with an arm and an observer that were calibrated without its samples from `start` on, up to `stop`.

    Whatever has a memory runs over the whole stretch, so that it has settled where it counts.
    """

    stretch: Stretch
    start: int
    stop: int
    robot: Robot
    observer: ObserverConfig

    @property
    def recording(self) -> Recording:
        """The stretch as a recording."""
        stretch = self.stretch
        return Recording(stretch.t, {"q": stretch.q, "dq": stretch.dq, "tau": stretch.tau}, source=stretch.source)

    def counts(self, settling_s: float) -> NDArray[np.bool_]:
        """Return which samples count for something that settles in `settling_s` after the start of the stretch (k,)."""
        k = np.arange(len(self.stretch))
        settled: NDArray[np.bool_] = self.stretch.t >= self.stretch.t[0] + settling_s
        return (k >= self.start) & (k < self.stop) & settled


def stretches_of(recordings: Sequence[Recording], robot: Robot) -> tuple[Stretch, ...]:
    """Return what of the recordings can be used.

    Raises:
        CalibrationError: if a recording is of an arm with another number of joints, or has no stretch without a gap.
    """
    found: list[Stretch] = []
    for recording in recordings:
        name = recording.source or "recording"
        if recording.n_joints != robot.n:
            raise CalibrationError(
                name,
                f"has {recording.n_joints} joints, but {robot.name} has {robot.n}: choose the robot it was taken of",
            )
        found += _stretches(recording, name)
    if not found:
        raise CalibrationError(recordings[0].source or "recording", f"holds no {_SHORTEST_S:g} s without a gap")
    return tuple(found)


def _stretches(recording: Recording, name: str) -> list[Stretch]:
    q, dq, tau = (recording.channels[channel] for channel in ("q", "dq", "tau"))
    return [
        Stretch(recording.t[rows], q[rows], dq[rows], tau[rows], name)
        for rows in gap_free(recording, ("q", "dq", "tau"))
    ]


def gap_free(recording: Recording, channels: Sequence[str]) -> list[NDArray[np.intp]]:
    """Return the rows of each stretch of good samples without a gap that is long enough."""
    values = np.concatenate([recording.channels[channel] for channel in channels], axis=1)
    rows = np.flatnonzero(np.isfinite(recording.t) & np.isfinite(values).all(axis=1))
    t = recording.t[rows]
    forward = np.append(True, t[1:] > np.maximum.accumulate(t)[:-1]) if len(t) else np.zeros(0, bool)
    rows = rows[forward]
    t = recording.t[rows]
    gap_s = max(0.05, 5 / recording.rate_hz)
    parts = np.split(rows, np.flatnonzero(np.diff(t) > gap_s) + 1) if len(rows) else []
    return [part for part in parts if len(part) > 1 and recording.t[part[-1]] - recording.t[part[0]] >= _SHORTEST_S]


def clock_of(stretches: Sequence[Stretch], rate_hz: float) -> float | None:
    """Return the period of the robot's own clock [s], or None where position and velocity do not tell one.

    While the arm moves, dx . v / |v|^2 is the time between two samples. Where nine in ten of these are whole multiples
    of one period, that period is the robot's, whatever the stamps say.
    """
    told = [_told_steps(stretch) for stretch in stretches]
    steps = np.concatenate(told)
    near = steps[np.abs(steps * rate_hz - 1) < 0.3]
    if len(near) < 200:
        return None
    period = float(np.median(near))
    nominal = round(period, 5)
    if nominal and abs(period / nominal - 1) < 2e-3:
        period = nominal
    return period if np.mean(np.abs(steps / period - np.round(steps / period)) < 0.1) > 0.9 else None


def _told_steps(stretch: Stretch) -> Array:
    v = 0.5 * (stretch.dq[1:] + stretch.dq[:-1])
    speed = np.einsum("ki,ki->k", v, v)
    along = np.einsum("ki,ki->k", np.diff(stretch.q, axis=0), v)
    fast = speed > (4 * MOVING_RAD_S) ** 2
    return along[fast] / speed[fast]  # type: ignore[no-any-return]


def quietest(stretches: Sequence[Stretch], robot: Robot, config: ObserverConfig, rate_hz: float) -> ObserverConfig:
    """Return the observer with the clock and the velocity that leave the least noise in its residual."""
    clock_s = clock_of(stretches, rate_hz)
    stretch = max(stretches, key=len)
    candidates = [
        config.model_copy(update={"velocity": velocity, "clock_s": clock})
        for velocity in ("measured", "position")[: 2 if rate_hz * config.velocity_window_s >= 1 else 1]
        for clock in dict.fromkeys((None, clock_s))
    ]

    def noise(candidate: ObserverConfig) -> float:
        r = MomentumObserver(robot, candidate).run(stretch.t, stretch.q, stretch.dq, stretch.tau)
        return float(np.sum(np.log(np.diff(r, axis=0).std(axis=0) + 1e-9)))

    quiet = min(candidates, key=noise)
    return quiet if noise(quiet) < noise(candidates[0]) - 0.05 * robot.n else candidates[0]
