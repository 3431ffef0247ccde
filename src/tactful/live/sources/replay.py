"""A recording, sample by sample, at any speed."""

from __future__ import annotations

import math
from pathlib import Path

from tactful.errors import TactfulError
from tactful.live._clock import Clock
from tactful.live._recorder import read_log
from tactful.live._source import Sample, Source, SourceError
from tactful.live.sources import Settings, fill_in
from tactful.monitor import MonitorConfig
from tactful.recordings import Recording

FORM = "replay:FILE"

_CHANNELS = ("q", "dq", "tau", "tau_ext", "wrench")


def settings_of(path: Path) -> MonitorConfig | None:
    """Return the settings with which a live run was recorded, None if the file is another recording."""
    try:
        log = read_log(path)
        config = MonitorConfig(**log["config"])
    except (TactfulError, KeyError, TypeError):
        return None
    if config.robot.model is None and log.get("robot"):
        config = config.model_copy(update={"robot": config.robot.model_copy(update={"model": log["robot"]})})
    return config


class ReplaySource(Source):
    """The rows of a recording, as they stand in it; that of a live run brings the settings that were in force.

    Args:
        name: what the user called it.
        path: the file.
        settings: arm, speed and mapping.
    """

    timed = False

    def __init__(self, name: str, path: Path, settings: Settings) -> None:
        self.name, self._path, self._mapping = name, path, settings.mapping
        known = settings_of(path)
        self.config = settings.config if known is None else fill_in(settings.config, known)
        self._clock = Clock(settings.speed)
        self._row = 0

    def open(self) -> None:
        """Read the recording.

        Raises:
            RecordingError: if it cannot be read.
            SourceError: if the arm is not named, or is another one.
        """
        recording = Recording.read(self._path, mapping=self._mapping)
        self.robot = robot = self.config.robot.load()
        n = recording.n_joints
        if robot is None and recording.wrench is None:
            raise SourceError(self.name, "which arm was recorded? Name it: --robot, or robot.model in the settings")
        if robot is not None and n is not None and n != robot.n:
            raise SourceError(self.name, f"{n} joints were recorded, but {robot.name} has {robot.n}: choose its robot")
        self.rate_hz = recording.rate_hz
        if not math.isfinite(self.rate_hz):
            raise SourceError(self.name, "time does not advance in it, so it has no rate")
        self._t = recording.t
        self._channels = [recording.channels.get(name) for name in _CHANNELS]

    def read(self) -> Sample | None:
        """Return the next row when it is due."""
        if self.ended:
            return None
        row = self._row
        self._row += 1
        t = float(self._t[row])
        if math.isfinite(t):
            self._clock.wait(t)
        return Sample(t, *(None if values is None else values[row] for values in self._channels))

    @property
    def ended(self) -> bool:
        """Whether the last row was given."""
        return self._row >= len(self._t)

    def close(self) -> None:
        """There is nothing to let go of."""


def create(name: str, address: str, settings: Settings) -> Source:
    """See `tactful.live.sources`."""
    if settings.react:
        raise SourceError(name, "a recording takes no torques, so nothing can be done about its contacts")
    if not address:
        raise SourceError(name, "no file is named: replay:FILE")
    return ReplaySource(name, Path(address), settings)
