"""What a source of samples is."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tactful.control import Pose
from tactful.errors import TactfulError
from tactful.monitor import ContactEvent, MonitorConfig
from tactful.robots import Robot

_LATE_PERIODS = 2.0


class SourceError(TactfulError):
    """A source cannot be used: `source` names it."""

    def __init__(self, source: str, problem: str) -> None:
        self.source = source
        super().__init__(f"{source}: {' '.join(problem.split())}")


class ConnectionLostError(SourceError):
    """A source that was there is gone."""


class Sample(NamedTuple):
    """What an arm's sensors say at one instant; what a source does not have is None."""

    t: float
    """Time on the source's clock [s]."""
    q: ArrayLike | None = None
    """Joint positions (n,) [rad]."""
    dq: ArrayLike | None = None
    """Joint velocities (n,) [rad/s]."""
    tau: ArrayLike | None = None
    """Joint torques, gravity included (n,) [Nm]."""
    tau_ext: ArrayLike | None = None
    """The robot's own external torque (n,) [Nm]."""
    wrench: ArrayLike | None = None
    """External wrench at the tip, base axes (6,) [N, Nm]."""


class Source(ABC):
    """Something that gives samples of an arm, one after the other.

    `rate_hz` and `robot` are known once it is open. A source that is `commanded` takes a torque after every sample.

    Attributes:
        name: what the user called it.
        rate_hz: nominal rate [Hz].
        robot: the arm; None where a wrench alone is given.
        commanded: whether every sample has to be answered with a torque.
        timed: whether samples come by a clock of their own, so that one can be late; a simulation or a recording is
            only slower than real time then.
        config: settings of the monitor; those that fit its arm, where it knows them and no others were given.
    """

    name: str
    rate_hz: float
    robot: Robot | None
    commanded: bool = False
    timed: bool = True
    config: MonitorConfig = MonitorConfig()

    @abstractmethod
    def open(self) -> None:
        """Connect, also again after a loss.

        Raises:
            SourceError: if there is no such source, or it is not this arm's.
        """

    def begin(self) -> None:  # noqa: B027 (most have nothing to do)
        """Make the next sample a new one, and take over a commanded arm; called once all is compiled.

        Raises:
            SourceError: if the arm cannot be taken over.
        """

    @abstractmethod
    def read(self) -> Sample | None:
        """Wait for the next sample and return it; None at the end, or if there was none for a short while.

        `ended` tells the two apart.

        Raises:
            ConnectionLostError: if the source has gone.
        """

    @property
    def ended(self) -> bool:
        """Whether no sample will follow."""
        return False

    def command(self, tau: NDArray[np.float64]) -> None:
        """Answer a sample with a torque (n,), without gravity's [Nm]."""
        raise SourceError(self.name, "takes no torques: it can only be listened to")

    def plan(self, t: float) -> Pose:
        """Return where the tip of a commanded arm is to be, by the time in its plan [s]."""
        raise SourceError(self.name, "has no plan: it can only be listened to")

    @property
    def posture(self) -> ArrayLike | None:
        """Posture of a commanded arm (n,) [rad], None for its home."""
        return None

    def tell(self, event: ContactEvent) -> None:  # noqa: B027 (most have nobody to tell)
        """Tell an event to those who listen at the source's side; called from another thread than `read`."""

    def lost(self) -> int:
        """Return how many samples the source itself knows to have lost so far."""
        return 0

    @abstractmethod
    def close(self) -> None:
        """Let go of the source, and of the arm; it may be closed already."""


class Traffic:
    """How the samples of a source came.

    Args:
        rate_hz: nominal rate [Hz].
        timed: whether samples come by a clock of their own, so that one can be late.
    """

    def __init__(self, rate_hz: float, *, timed: bool = True) -> None:
        self.samples = self.lost = self.late = 0
        self._period_s = 1 / rate_hz
        self._timed = timed
        self._t: float | None = None
        self._arrived = 0.0

    def count(self, t: float, arrived: float) -> None:
        """Take note of a sample of the time t [s] that arrived at `arrived` on the host's clock [s].

        Samples that fit into a jump of t are lost. A sample is late if it came more than two periods later than its
        time stamp and the arrival of the one before let expect.
        """
        if self._t is not None and math.isfinite(t):
            step = t - self._t
            if step > 1.5 * self._period_s:
                self.lost += round(step / self._period_s) - 1
            if self._timed and arrived - self._arrived - step > _LATE_PERIODS * self._period_s:
                self.late += 1
        self.samples += 1
        self._t, self._arrived = t if math.isfinite(t) else self._t, arrived

    def restart(self) -> None:
        """Expect nothing of the next sample: the source was away."""
        self._t = None
