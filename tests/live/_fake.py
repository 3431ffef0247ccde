"""A source whose samples, losses and commands a test decides."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tactful import MonitorConfig, Robot
from tactful.control import Pose
from tactful.dynamics import Dynamics
from tactful.live import ConnectionLostError, Sample, Source, SourceError

PANDA = Robot.load("panda")
_HOME = Pose(*Dynamics(PANDA).pose(PANDA.home))


class FakeSource(Source):
    """Give an arm at rest: one list of times for each time that it is opened, then the end; in between it is lost."""

    def __init__(self, *stretches: Sequence[float], commanded: bool = False, refuse: int = 0) -> None:
        self.name, self.rate_hz, self.robot = "fake", 1000.0, PANDA
        self.commanded, self.timed = commanded, False
        self.config = MonitorConfig(robot={"model": "panda"})
        self.stretches = [list(stretch) for stretch in stretches]
        self.torques: list[NDArray[np.float64]] = []
        self.opened = self.closed = 0
        self._refuse = refuse
        self._tau = Dynamics(PANDA).gravity(PANDA.home)

    def open(self) -> None:
        self.opened += 1
        if self.opened > 1 and self._refuse > 0:
            self._refuse -= 1
            raise SourceError(self.name, "not there yet")

    def read(self) -> Sample | None:
        if not self.stretches[0]:
            if len(self.stretches) == 1:
                return None
            self.stretches.pop(0)
            raise ConnectionLostError(self.name, "the line is cut")
        return Sample(self.stretches[0].pop(0), PANDA.home, np.zeros(7), self._tau)

    @property
    def ended(self) -> bool:
        return len(self.stretches) == 1 and not self.stretches[0]

    def command(self, tau: NDArray[np.float64]) -> None:
        self.torques.append(tau)

    def plan(self, t: float) -> Pose:
        return _HOME

    @property
    def posture(self) -> ArrayLike:
        return PANDA.home

    def close(self) -> None:
        self.closed += 1


def times(start: float, count: int) -> list[float]:
    return [start + 0.001 * k for k in range(count)]
