"""A Franka arm over its own interface (libfranka), at 1 kHz."""

from __future__ import annotations

import os
import threading
from contextlib import suppress
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tactful.control import Pose
from tactful.dynamics import Dynamics
from tactful.live._source import ConnectionLostError, Sample, Source, SourceError
from tactful.live.sources import Settings
from tactful.live.sources._arm import find_arm, knock
from tactful.robots import Robot

FORM = "franka://HOST"

_PORT = 1337
_ARMS = ("fr3", "panda")


class FrankaSource(Source):
    """The state of the arm, 1000 times a second; with reactions, within the loop that commands its torques.

    The clock is the robot's: its time stamps advance by 1 ms a state, so a jump says how many were lost. The arm
    compensates gravity and friction itself, commanded torques come on top. Without reactions the arm is only listened
    to, whatever program moves it.

    Args:
        name: what the user called it.
        host: name or address of the arm's control.
        settings: the arm, an FR3 by default, and whether torques are commanded.
    """

    rate_hz = 1000.0
    robot: Robot

    def __init__(self, name: str, host: str, settings: Settings) -> None:
        try:
            import pylibfranka
        except ImportError:
            raise SourceError(
                name, 'needs pylibfranka (Linux, Python up to 3.12): pip install "tactful[franka]"'
            ) from None
        self.name, self._host, self._franka = name, host, pylibfranka
        self.robot = find_arm(name, settings.config, default=_ARMS[0], joints=7)
        if settings.config.robot.model in {*Robot.names()} - {*_ARMS}:
            raise SourceError(name, f"is an arm of Franka, not {self.robot.title}: choose {' or '.join(_ARMS)}")
        self.commanded, self.config = settings.react, settings.config
        self._robot: Any = None
        self._control: Any = None
        self._priority: _Priority | None = None
        self._tau = [0.0] * 7
        self._start: Pose | None = None
        self._q: ArrayLike | None = None

    def open(self) -> None:
        """Connect.

        Raises:
            SourceError: if nobody answers, the interface is taken or of another version, or the arm is not ready.
        """
        knock(self.name, self._host, _PORT, "check the address and that FCI is active")
        franka = self._franka
        self._priority = _Priority()
        try:
            self._robot = franka.Robot(self._host, franka.RealtimeConfig.kIgnore)
            self._priority.keep_to_thread()
            state = self._robot.read_once()
            if self.commanded:
                if state.robot_mode != franka.RobotMode.Idle:
                    raise SourceError(
                        self.name,
                        f"the arm is not ready to move, its mode is {state.robot_mode.name}: release the user stop, "
                        "recover from errors in Desk and activate FCI",
                    )
                self._q = np.array(state.q)
        except (franka.FrankaException, RuntimeError) as error:
            self.close()
            raise SourceError(self.name, f"cannot be used: {error}") from None

    def begin(self) -> None:
        """Leave out the states that have waited; with reactions, begin to hold the arm where it is."""
        try:
            state = self._robot.read_once()
            if self.commanded:
                self._start = Pose(*Dynamics(self.robot).pose(np.array(state.q)))
                self._control = self._robot.start_torque_control()
        except (self._franka.FrankaException, RuntimeError) as error:
            self.close()
            raise SourceError(self.name, f"cannot be used: {error}") from None

    def read(self) -> Sample:
        """Wait for the next state."""
        try:
            state = self._robot.read_once() if self._control is None else self._control.readOnce()[0]
        except (self._franka.FrankaException, RuntimeError) as error:
            self._control = None
            raise ConnectionLostError(self.name, f"the arm stopped, or its connection is lost: {error}") from None
        return Sample(state.time.to_sec(), state.q, state.dq, state.tau_J)

    def command(self, tau: NDArray[np.float64]) -> None:
        """Send a torque (7,) [Nm]."""
        self._tau = tau.tolist()
        with suppress(self._franka.FrankaException, RuntimeError):  # the next `read` tells
            self._control.writeOnce(self._franka.Torques(self._tau))

    def plan(self, t: float) -> Pose:
        """Stay where the arm was found."""
        assert self._start is not None
        return self._start

    @property
    def posture(self) -> ArrayLike | None:
        """Return the posture in which the arm was found."""
        return self._q

    def close(self) -> None:
        """End the motion, if there is one; the arm then holds itself."""
        if self._control is not None:
            last = self._franka.Torques(self._tau)
            last.motion_finished = True
            with suppress(self._franka.FrankaException, RuntimeError):  # it has stopped already
                self._control.writeOnce(last)
        self._control = self._robot = None
        if self._priority is not None:
            self._priority.restore()


class _Priority:
    """What the scheduler does for this thread.

    libfranka raises it to the highest real-time priority, for good. What the thread starts from then on (a recorder, a
    page, any other program) would inherit that and could keep the loop, and the machine, from going on.
    """

    def __init__(self) -> None:
        self._thread = threading.get_native_id()
        self._before = os.sched_getscheduler(0), os.sched_getparam(0)

    def keep_to_thread(self) -> None:
        """Let what this thread starts begin without it."""
        with suppress(OSError):  # a system that does not allow it has not raised it either
            os.sched_setscheduler(0, os.sched_getscheduler(0) | os.SCHED_RESET_ON_FORK, os.sched_getparam(0))

    def restore(self) -> None:
        """Take it back; the thread may have ended."""
        policy, parameter = self._before
        for flag in (0, os.SCHED_RESET_ON_FORK):  # only the privileged may drop the flag
            with suppress(OSError):
                os.sched_setscheduler(self._thread, policy | flag, parameter)
                return


def create(name: str, address: str, settings: Settings) -> Source:
    """See `tactful.live.sources`."""
    if not address:
        raise SourceError(name, "no arm is named: franka://HOST")
    return FrankaSource(name, address, settings)
