"""Play a recording in the page: a scrubber, and buttons."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from tactful.live.view._messages import Array, Past

if TYPE_CHECKING:
    import viser

_FRAMES_PER_S = 30.0


class Player:
    """Where a recording is looked at.

    Args:
        server: the page.
        past: the recording.
        show: shows a time [s] with the joint positions then.
    """

    def __init__(self, server: viser.ViserServer, past: Past, show: Callable[[float, Array | None], None]) -> None:
        self._past, self._show = past, show
        t = past.trace.t
        self.start_s, self.end_s = (float(t[0]), float(t[-1])) if len(t) else (0.0, 1.0)
        self._t = self.start_s
        self._playing = True
        self._over = threading.Event()
        self._speed = 1.0
        gui = server.gui
        span = max(self.end_s - self.start_s, 0.01)
        self._slider = gui.add_slider("Time [s]", min=0.0, max=span, step=0.01, initial_value=0.0)
        self._button = gui.add_button("Pause", icon="player-pause")
        speed = gui.add_dropdown("Speed", ("0.1", "0.25", "0.5", "1", "2", "5"), initial_value="1")

        @self._slider.on_update
        def _(event: viser.GuiEvent) -> None:
            if event.client is not None:
                self._playing = False
                self._t = self.start_s + float(self._slider.value)
                self._look()

        @self._button.on_click
        def _(_: viser.GuiEvent) -> None:
            if not self._playing and self._t >= self.end_s:
                self._t = self.start_s
            self._playing = not self._playing

        @speed.on_update
        def _(_: viser.GuiEvent) -> None:
            self._speed = float(speed.value)

        threading.Thread(target=self._play, name="tactful-player", daemon=True).start()

    def go_to(self, t: float) -> None:
        """Look at a time [s], and stay there."""
        self._playing = False
        self._t = min(max(t, self.start_s), self.end_s)
        self._slider.value = round(self._t - self.start_s, 2)
        self._look()

    def stop(self) -> None:
        """Show nothing more."""
        self._over.set()

    def _play(self) -> None:
        last = time.monotonic()
        ticks = 0
        while not self._over.wait(1 / _FRAMES_PER_S):
            now = time.monotonic()
            if self._playing:
                self._t = min(self._t + self._speed * (now - last), self.end_s)
                self._playing = self._t < self.end_s
                ticks += 1
                if ticks % 6 == 0 or not self._playing:
                    self._slider.value = round(self._t - self.start_s, 2)
            self._button.label = "Pause" if self._playing else "Play"
            last = now
            self._look()

    def _look(self) -> None:
        t = self._past.trace.t
        row = min(int(np.searchsorted(t, self._t)), len(t) - 1)
        q = self._past.q
        self._show(self._t, None if q is None or row < 0 else q[row])
