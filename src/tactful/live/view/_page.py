"""The page, in a process of its own."""

from __future__ import annotations

import html
import os
import queue
import signal
import threading
import time
from collections import deque
from dataclasses import replace
from multiprocessing.connection import Connection
from typing import TYPE_CHECKING, Any

import numpy as np

from tactful.live.view._contacts import Contacts
from tactful.live.view._controls import Controls
from tactful.live.view._history import History, norm
from tactful.live.view._messages import Array, Frame, Past, Setup, Trace, Wish
from tactful.live.view._player import Player
from tactful.live.view._scene import Scene
from tactful.live.view._signals import Signals
from tactful.live.view._words import COLOURS, kind_of
from tactful.monitor import ContactEvent

if TYPE_CHECKING:
    import viser

_PLOTS_PER_S, _STRIPS_PER_S = 10.0, 4.0
_PACE_S, _SLOW = 5.0, 0.95
"""Over which time the pace of a simulation is measured [s], and below which share of its speed it is told."""
_SHOWN_S = 2.0
"""How long a contact stays marked after its end [s]."""
_PANEL_PX, _SIGNALS_PX = 360, 340


def serve(pipe: Connection, port: int) -> None:
    """Serve the page at a port of this machine, until the other end of the pipe is closed."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)  # standard output is for the events
    import viser

    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the loop ends in order, and then the page
    server = viser.ViserServer(host="127.0.0.1", port=port, label="Tactful", verbose=False)
    server.gui.configure_theme(show_logo=False, show_share_button=False, brand_color=(33, 102, 196))
    server.gui.main_panel.dock_right()
    server.gui.main_panel.set_width(_PANEL_PX)
    server.scene.set_up_direction("+z")
    wishes: queue.SimpleQueue[Wish] = queue.SimpleQueue()
    threading.Thread(target=_send, args=(pipe, wishes), daemon=True).start()
    waiting = server.gui.add_markdown("Getting ready. The first time ever, this takes about 20 s.")
    pipe.send("ready")
    page: Page | None = None
    try:
        while True:
            message = pipe.recv()
            if isinstance(message, Setup):
                if page is None:
                    waiting.remove()
                else:
                    page.remove()
                page = Page(server, message, wishes)
            elif isinstance(message, Past) and page is not None:
                page.play(message)
            elif isinstance(message, Frame) and page is not None:
                with server.atomic():
                    page.update(message)
    except (EOFError, OSError):
        if page is not None:
            page.stop()
        server.stop()


def _send(pipe: Connection, wishes: queue.SimpleQueue[Wish]) -> None:
    while True:
        wish = wishes.get()
        try:
            pipe.send(wish)
        except OSError:
            return


class Page:
    """The page of one run.

    Args:
        server: what serves it.
        setup: what is watched.
        wishes: where to put what the user wants.
    """

    def __init__(self, server: viser.ViserServer, setup: Setup, wishes: queue.SimpleQueue[Wish]) -> None:
        self._server, self._setup, self._wishes = server, setup, wishes
        self._history = History()
        self._latest: ContactEvent | None = None
        self._q: Array | None = None
        self._drawn = dict.fromkeys(("plots", "strip", "state"), 0.0)
        self._times: deque[tuple[float, float]] = deque(maxlen=round(_PACE_S * _STRIPS_PER_S))
        live = setup.workshop
        self._scene = Scene(server, setup, self._drag if live else None, self._put if live else None)
        self._state = server.gui.add_html("")
        self._player: Player | None = None
        self._controls = Controls(server, setup, self._ask)
        if not setup.recorded:
            self._controls.run()
        self._tabs = server.gui.add_tab_group()
        with self._tabs.add_tab("Contacts", "list"):
            self._contacts = Contacts(server, self._chosen)
        if live:
            with self._tabs.add_tab("Touch", "hand-finger"):
                self._controls.touch(self._scene.middle_of)
        if not setup.recorded:
            with self._tabs.add_tab("Settings", "adjustments"):
                self._controls.settings()
        self._signals = Signals(server, setup)
        self._signals.panel.dock_left()
        self._signals.panel.set_width(_SIGNALS_PX)
        self._tell("waiting for samples", "free", "")

    def play(self, past: Past) -> None:
        """Show a recording, which is played and scrubbed here."""
        self._history = History(past.trace)
        self._contacts.set(past.events)
        with self._tabs.add_tab("Recording", "player-play"):
            self._player = Player(self._server, past, self._at)

    def _at(self, t: float, q: Array | None) -> None:
        """Show a recording at the time t [s]."""
        assert self._player is not None
        with self._server.atomic():
            self._scene.place(q)
            event = self._contacts.at(t)
            shown = event if event is not None and t <= (event.end_s or t) + _SHOWN_S else None
            self._scene.mark(self._contacts.chosen or shown)
            now = shown if shown is not None and (shown.end_s is None or t <= shown.end_s) else None
            trace = self._history.window(t - 0.05, t + 0.05)
            if trace is not None:
                self._scene.feel(trace.force_n[len(trace.t) // 2])
            if self._due("plots", _PLOTS_PER_S):
                self._signals.draw(self._history, t, ahead_s=2.0)
                self._contacts.at_time(t)
                self._contacts.draw(t, self._player.start_s, self._player.end_s)
                self._tell(kind_of(now) if now else "free", now.kind if now else "free", f"{t:.2f} s of the recording")

    def update(self, frame: Frame) -> None:
        """Show what has come."""
        self._history.add(frame.trace)
        self._q = frame.q if frame.q is not None else self._q
        self._scene.place(frame.q)
        self._scene.update(frame)
        for _, event in frame.events:
            self._scene.pin(event)
            self._contacts.add(event)
            self._latest = event
        self._follow_peak(frame.trace)
        latest = self._latest
        recent = latest is not None and (latest.end_s is None or frame.t <= latest.end_s + _SHOWN_S)
        self._scene.mark(self._contacts.chosen or (latest if recent else None))
        if self._due("plots", _PLOTS_PER_S):
            self._signals.draw(self._history, frame.t)
        if self._due("strip", _STRIPS_PER_S) or frame.events:
            self._contacts.draw(frame.t)
            self._controls.update(frame)
            self._show_state(frame)

    def _follow_peak(self, trace: Trace) -> None:
        """Show of a contact that lasts the largest force so far; the monitor tells it at its end."""
        latest = self._latest
        if latest is None or latest.end_s is not None:
            return
        force_n = norm(trace.force_n[trace.t >= latest.onset_s])
        if len(force_n) and force_n.max() > latest.peak_force_n + 0.5:
            self._latest = replace(latest, peak_force_n=float(force_n.max()))
            self._contacts.add(self._latest)

    def stop(self) -> None:
        """Show nothing new."""
        if self._player is not None:
            self._player.stop()

    def remove(self) -> None:
        """Make room for another run."""
        self.stop()
        self._signals.panel.remove()
        self._server.gui.reset()
        self._server.scene.reset()

    def _show_state(self, frame: Frame) -> None:
        latest = self._latest
        there = latest is not None and latest.end_s is None
        kind = latest.kind if there and latest is not None else "free"
        words = kind.replace("_", " ") if frame.ready else "warming up"
        if frame.paused:
            words = "paused"
        doing = {"continue": "goes on", "stop": "stops", "retract": "retracts", "comply": "complies", "teach": "is led"}
        details = [f"{frame.t:.1f} s"]
        if self._setup.commanded:
            details.append(f"the arm {doing[frame.reaction]}")
        if (pace := self._pace(frame)) is not None:
            details.append(f"{pace:.2g} s of simulation a second")
        details.append(f"{frame.samples} samples, {frame.lost or 'none'} lost")
        if frame.late:
            details.append(f"{frame.late} late")
        if frame.computing_s == frame.computing_s:
            details.append(f"each computed within {1e3 * frame.computing_s:.2f} ms (99.9 %)")
        if frame.degraded:
            details.append("degraded: bad samples are skipped")
        if frame.recording:
            details.append("recording")
        self._tell(words, kind, " · ".join(details))

    def _pace(self, frame: Frame) -> float | None:
        """Return how fast simulated time passes, None where it keeps its speed."""
        now = time.monotonic()
        if frame.paused or not self._setup.speed:
            self._times.clear()
            return None
        self._times.append((now, frame.t))
        since, begun = self._times[0]
        pace = (frame.t - begun) / (now - since) if now - since > 1.0 else self._setup.speed
        return pace if pace < _SLOW * self._setup.speed else None

    def _tell(self, words: str, kind: str, details: str) -> None:
        robot = self._setup.robot.title if self._setup.robot else "no robot, wrench alone"
        chip = (
            f"background:{COLOURS[kind]};color:#fff;border-radius:6px;padding:7px 12px;font-size:19px;font-weight:600"
        )
        small = "color:#7b8a97;font-size:12px;line-height:1.4"
        self._state.content = (
            f"<div style='margin:2px 9px 6px'><div data-tactful='state' aria-live='polite' style='{chip}'>"
            f"{html.escape(words)}</div><div style='color:#3b4a57;font-size:12.5px;margin-top:6px'>"
            f"{html.escape(robot)} · {html.escape(self._setup.source)}</div>"
            f"<div data-tactful='details' style='{small}'>{html.escape(details)}</div></div>"
        )

    def _due(self, what: str, per_s: float) -> bool:
        now = time.monotonic()
        if now - self._drawn[what] < 1 / per_s:
            return False
        self._drawn[what] = now
        return True

    def _chosen(self, event: ContactEvent | None) -> None:
        self._scene.mark(event)
        if event is not None and self._player is not None:
            self._player.go_to(event.onset_s)

    def _ask(self, name: str, *values: Any) -> None:
        self._wishes.put(Wish(name, values))

    def _drag(self, phase: str, link: int, held_m: Array, mouse_m: Array) -> None:
        if phase == "start":
            self._ask("grab", link, held_m, mouse_m)
        elif phase == "update":
            self._ask("pull", mouse_m)
        else:
            self._ask("let_go")

    def _put(self, obstacle_m: Array) -> None:
        self._ask("put", np.asarray(obstacle_m))
