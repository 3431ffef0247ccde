"""Clocks: one makes samples come when they are due, one tells how long somebody was waited for."""

from __future__ import annotations

import time

_BEHIND_S = 0.5
"""From so far behind, robot time does not catch up any more [s]."""


class Clock:
    """Wait until robot time is due.

    Args:
        speed: robot time that passes in a second; 0 does not wait.
    """

    def __init__(self, speed: float) -> None:
        self._speed = speed
        self._start: tuple[float, float] | None = None

    def wait(self, t: float) -> None:
        """Sleep until the robot time t [s] is due."""
        if not self._speed:
            return
        now = time.perf_counter()
        if self._start is None:
            self._start = (t, now)
        since, begun = self._start
        ahead = begun + (t - since) / self._speed - now
        if ahead > 0:
            time.sleep(ahead)
        elif ahead < -_BEHIND_S:
            self._start = (t, now)

    def restart(self) -> None:
        """Let robot time go on from when it is waited for next."""
        self._start = None


class Patience:
    """How long somebody may be silent: only the time counts in which this process ran and could have heard.

    Args:
        limit_s: how long [s].
        look_s: how long it takes at most from one look to the next, unless the process stood still [s].
    """

    def __init__(self, limit_s: float, look_s: float) -> None:
        self._left_s, self._look_s = limit_s, look_s
        self._looked = time.monotonic()

    def over(self) -> bool:
        """Return whether it is over; called at every look."""
        now = time.monotonic()
        self._left_s -= min(now - self._looked, self._look_s)
        self._looked = now
        return self._left_s < 0
