"""A clock that makes samples come when they are due."""

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
