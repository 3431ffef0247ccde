"""The work cell in simulation, in real time: an arm runs into a post, and a hand helps it round."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tactful.control import Pose
from tactful.live._clock import Clock
from tactful.live._source import Sample, Source, SourceError
from tactful.live.sources import Settings
from tactful.live.sources._arm import find_arm

FORM = "sim or sim:SEED"

_ARM = "panda"


class SimSource(Source):
    """The episode `collision_and_help`, in the time that it takes; it ends with its last sample.

    Args:
        name: what the user called it.
        seed: what the episode is drawn from.
        settings: the arm as the monitor knows it, and the speed.
    """

    commanded = True

    def __init__(self, name: str, seed: int, settings: Settings) -> None:
        self.name, self._seed = name, seed
        self.robot = find_arm(name, settings.config, default=_ARM)
        self.speed = settings.speed or None
        self._clock = Clock(settings.speed)

    def open(self) -> None:
        """Build the cell."""
        from tactful.simulation import collision_and_help

        self.episode = collision_and_help(np.random.default_rng(self._seed))
        self.cell = self.episode.cell
        self.rate_hz = 1 / self.cell.config.period_s
        self._tau = np.zeros(self.cell.robot.n)
        self._posture = self.cell.q.copy()

    def read(self) -> Sample | None:
        """Hold the torque for one period, and return the sample at its begin."""
        if self.ended:
            return None
        self._clock.wait(self.cell.t)
        return Sample(*self.cell.step(self._tau)[:4])

    @property
    def ended(self) -> bool:
        """Whether the episode is over."""
        return self.cell.t >= self.episode.duration_s - 1e-9

    def command(self, tau: NDArray[np.float64]) -> None:
        """Take the torque for the next period."""
        self._tau = tau

    def plan(self, t: float) -> Pose:
        """Return the episode's own reference."""
        return self.episode.path.pose(t)

    @property
    def posture(self) -> ArrayLike:
        """Return the posture in which the episode begins."""
        return self._posture

    def close(self) -> None:
        """Leave the cell as it is: its truth can be asked for."""


def create(name: str, address: str, settings: Settings) -> Source:
    """See `tactful.live.sources`."""
    try:
        seed = int(address or 0)
    except ValueError:
        seed = -1
    if seed < 0:
        raise SourceError(name, f"{address!r} is no seed: give a whole number from 0 on, or nothing")
    if (model := settings.config.robot.model) not in (None, _ARM):
        raise SourceError(name, f"the arm in the cell is a {_ARM}, not {model}")
    return SimSource(name, seed, settings)
