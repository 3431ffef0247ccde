"""A Universal Robots arm over RTDE."""

from __future__ import annotations

import time
from typing import Any
from urllib.parse import parse_qs

import numpy as np

from tactful.live._clock import Patience
from tactful.live._source import ConnectionLostError, Sample, Source, SourceError
from tactful.live.sources import Settings
from tactful.live.sources._arm import find_arm, knock

FORM = "ur://HOST"

_VARIABLES = ["timestamp", "actual_q", "actual_qd", "actual_current"]
_NM_A = (10.0, 10.7, 8.46, 9.0, 9.48, 10.1)
"""Torque of a joint over its motor current [Nm/A], as github.com/mikhel1984/ext_observer states them for a UR arm."""
_PORT = 30004
_POLL_S = 1e-4
_SILENCE_S, _LOOK_S = 1.0, 0.01
_FIRST = 21
_RATES_HZ = (125.0, 250.0, 500.0)


class UrSource(Source):
    """What the arm's controller sends 125 (CB) or 500 (e-Series) times a second.

    The joint torque is actual_current times a constant a joint; it holds the friction of the gears. RTDE gives no
    measured torque. The arm is listened to; torques are not commanded.

    Args:
        name: what the user called it.
        host: name or address of the arm's control.
        nm_a: torque over motor current of each joint (6,) [Nm/A].
        settings: the arm.
    """

    def __init__(self, name: str, host: str, nm_a: tuple[float, ...], settings: Settings) -> None:
        try:
            from rtde_receive import RTDEReceiveInterface
        except ImportError:
            raise SourceError(name, 'needs ur-rtde: pip install "tactful[ur]"') from None
        self.name, self._host, self._interface = name, host, RTDEReceiveInterface
        self.robot = find_arm(name, settings.config, default=None, joints=6)
        self.config = settings.config
        self._nm_a = np.array(nm_a)  # (6,)
        self._rtde: Any = None
        self._t = float("nan")

    def open(self) -> None:
        """Connect, and find the rate from the first samples.

        Raises:
            SourceError: if nobody answers, or no samples come.
        """
        knock(self.name, self._host, _PORT, "check the address")
        for last in (False, True):  # the client misses the answer to its start now and then
            try:
                self._rtde = self._interface(self._host, -1.0, _VARIABLES)
                self._t = self._rtde.getTimestamp()
                stamps = [self.read().t for _ in range(_FIRST)]
                break
            except (RuntimeError, ValueError, OSError, ConnectionLostError) as error:
                self.close()
                if last:
                    said = "it sends nothing" if isinstance(error, ConnectionLostError) else str(error)
                    raise SourceError(self.name, f"the controller at {self._host} cannot be used: {said}") from None
        step_s = float(np.min(np.diff(stamps)))  # others may hold packets that were lost
        self.rate_hz = min(_RATES_HZ, key=lambda rate: abs(rate * step_s - 1))

    def read(self) -> Sample:
        """Wait for the next sample."""
        rtde = self._rtde
        patience = Patience(_SILENCE_S, _LOOK_S)
        while True:
            t = rtde.getTimestamp()
            if t != self._t:
                sample = Sample(t, rtde.getActualQ(), rtde.getActualQd(), self._nm_a * rtde.getActualCurrent())
                if rtde.getTimestamp() == t:  # all of one moment
                    self._t = t
                    return sample
                continue
            if patience.over() or not rtde.isConnected():
                raise ConnectionLostError(self.name, "the controller has stopped sending")
            time.sleep(_POLL_S)

    def close(self) -> None:
        """Disconnect."""
        if self._rtde is not None:
            self._rtde.disconnect()
            self._rtde = None


def create(name: str, address: str, settings: Settings) -> Source:
    """See `tactful.live.sources`."""
    host, _, query = address.partition("?")
    options = parse_qs(query, keep_blank_values=True)
    if not host:
        raise SourceError(name, "no arm is named: ur://HOST")
    if unknown := [key for key in options if key != "nm_a"]:
        raise SourceError(
            name, f"unknown option {unknown[0]!r}: there is nm_a, as in ur://HOST?nm_a=10,10.7,8.5,9,9.5,10"
        )
    nm_a: tuple[float, ...] = _NM_A
    if "nm_a" in options:
        try:
            nm_a = tuple(float(number) for number in options["nm_a"][-1].split(","))
        except ValueError:
            nm_a = ()
        if len(nm_a) != 6 or not all(0 < abs(number) < float("inf") for number in nm_a):
            raise SourceError(
                name, f"nm_a is {options['nm_a'][-1]!r}: give six numbers, the torque over the current [Nm/A]"
            )
    if settings.react:
        raise SourceError(name, "torques of this arm are not commanded, so nothing can be done about its contacts")
    return UrSource(name, host, nm_a, settings)
