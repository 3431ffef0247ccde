"""The loop's end of the page: it hands over what comes, and brings back what the user wants."""

from __future__ import annotations

import multiprocessing
import socket
import threading
import time
from collections.abc import Callable
from datetime import datetime
from importlib.util import find_spec
from multiprocessing.connection import Connection
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from tactful.errors import TactfulError
from tactful.live._recorder import Recorder
from tactful.live._session import Session
from tactful.live._source import Sample
from tactful.live.sources.sim import SimSource
from tactful.live.view._keep import keep
from tactful.live.view._messages import Frame, Past, Setup, Wish, thin
from tactful.monitor import MonitorConfig
from tactful.reaction import NAMED
from tactful.simulation import OBSTACLE_SIZE_M, Rounds

Array = NDArray[np.float64]

FRAMES_PER_S = 30
_START_S = 60.0
"""Longest time in which the page's process has to be there; on a busy machine, its imports take a while."""


def level_thresholds(config: MonitorConfig) -> Array:
    """Return what the levels of a trace are relative to (3,): in fast mode they are so already."""
    if config.mode == "fast":
        return np.array([1.0, np.inf, np.inf])
    return np.array(np.broadcast_to(config.frequency.threshold_n, (3,)), dtype=np.float64)


class View:
    """The page of a running monitor, in a process of its own: the loop never waits for it.

    A thread takes what came from the feed 30 times a second and sends it; another takes the user's wishes, which the
    loop fulfils between two samples. A page that is too slow misses samples, nothing else.

    Args:
        port: where the page is served, on this machine alone; 0 takes any that is free.

    Attributes:
        address: where the page is.

    Raises:
        TactfulError: if viser is not installed, the port is in use, or the page does not start.
    """

    def __init__(self, port: int = 8080) -> None:
        if find_spec("viser") is None:
            raise TactfulError('the page needs viser: pip install "tactful[view]"')
        from tactful.live.view._page import serve

        context = multiprocessing.get_context("spawn")
        self._pipe, theirs = context.Pipe()
        port = _free(port)
        self.address = f"http://127.0.0.1:{port}"
        self._process = context.Process(target=serve, args=(theirs, port), name="tactful-page", daemon=True)
        self._process.start()
        theirs.close()
        if not self._pipe.poll(_START_S):
            self.close()
            raise TactfulError(f"the page did not start within {_START_S:g} s")
        try:
            self._pipe.recv()
        except EOFError:
            raise TactfulError(f"the page could not be served at port {port}") from None
        self._follower: _Follower | None = None

    def show(self, setup: Setup, past: Past) -> None:
        """Show a recording."""
        self._pipe.send(setup)
        self._pipe.send(past)

    def follow(self, session: Session, policy: str | None = None) -> None:
        """Show a session that is open, from its first sample on."""
        self._follower = _Follower(self._pipe, session, policy)

    def finish(self) -> bool:
        """Send what is left of the session; return whether the user wants another run."""
        again = self._follower is not None and self._follower.finish()
        self._follower = None
        return again

    def wait(self, over: Callable[[], bool]) -> None:
        """Wait until something is over, or the page is."""
        while self._process.is_alive() and not over():
            self._process.join(0.2)

    def close(self) -> None:
        """End the page."""
        self.finish()
        self._pipe.close()
        self._process.join(3.0)
        if self._process.is_alive():
            self._process.terminate()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


def _free(port: int) -> int:
    """Return the port, or any that is free for 0.

    Raises:
        TactfulError: if it is in use.
    """
    with socket.socket() as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind(("127.0.0.1", port))
        except (OSError, OverflowError) as error:
            reason = getattr(error, "strerror", None) or str(error)
            raise TactfulError(
                f"port {port}: the page cannot be served there: {reason}; choose another --port"
            ) from None
        return int(probe.getsockname()[1])


class _Follower:
    """Two threads between a session and the page."""

    def __init__(self, pipe: Connection, session: Session, policy: str | None) -> None:
        self._pipe, self._session = pipe, session
        self._source = session.source
        self._shop = session.source if isinstance(session.source, SimSource) else None
        self._recorder: Recorder | None = None
        self._notice: str | None = None
        self._plan: Rounds | None = None
        self._way_m: Array | None = None
        self._again = False
        self._done = threading.Event()
        pipe.send(_setup(session, policy))
        self._threads = [
            threading.Thread(target=run, name=name, daemon=True)
            for run, name in ((self._show, "tactful-view"), (self._listen, "tactful-wishes"))
        ]
        for thread in self._threads:
            thread.start()

    def finish(self) -> bool:
        self._done.set()
        for thread in self._threads:
            thread.join()
        self._stop_recording()
        return self._again

    def _show(self) -> None:
        """Send a frame 30 times a second, as soon as there are samples."""
        session = self._session
        threshold = level_thresholds(session.monitor.config)
        last = -np.inf
        subscription = None
        over, due = False, time.monotonic()
        while not over:
            due = max(due + 1 / FRAMES_PER_S, time.monotonic())
            over = self._done.wait(due - time.monotonic())
            if session.feed is None:
                continue
            subscription = subscription or session.feed.subscribe()
            batch = subscription.read()
            if not len(batch.t) and not batch.events and self._shop is None:
                continue
            rows = session.monitor.recent(min(int(0.9 * session.source.rate_hz), len(batch.t) + 20))
            rows = rows[rows["t"] > last]
            last = float(rows["t"][-1]) if len(rows) else last
            q = batch.channels.get("q")
            report, shop = session.report, self._shop
            frame = Frame(
                t=float(batch.t[-1]) if len(batch.t) else last,
                q=q[-1].copy() if q is not None and len(q) else None,
                trace=thin(rows, threshold)[0],
                events=batch.events,
                reaction=session.reactor.reaction if session.reactor else "continue",
                ready=session.monitor.ready,
                degraded=session.monitor.degraded,
                samples=report.samples,
                lost=report.lost,
                late=report.late,
                computing_s=report.computing_s,
                paused=bool(shop and shop.paused),
                recording=str(self._recorder.path) if self._recorder else None,
                notice=self._notice,
                obstacle_m=shop.obstacle_m if shop else None,
                hand=shop.hand() if shop else None,
                taught=len(session.reactor.taught) if session.reactor else 0,
                way_m=self._way_m,
            )
            self._way_m = None
            try:
                self._pipe.send(frame)
            except OSError:  # the page has gone; the monitor goes on
                return

    def _listen(self) -> None:
        """Take wishes until the session is over."""
        while not self._done.is_set():
            try:
                if self._pipe.poll(0.1):
                    self._fulfil(self._pipe.recv())
            except (EOFError, OSError):
                return

    def _fulfil(self, wish: Wish) -> None:
        try:
            getattr(self, f"_wish_{wish.name}")(*wish.values)
        except TactfulError as error:
            self._notice = str(error)

    def _wish_pause(self, paused: bool) -> None:
        if self._shop is not None:
            self._session.pardon()
            self._shop.paused = paused

    def _wish_restart(self) -> None:
        self._again = True
        self._wish_pause(False)
        self._session.stop()

    def _wish_record(self, on: bool) -> None:
        if not on:
            self._stop_recording()
        elif self._recorder is None and self._session.feed is not None:
            path = Path(f"tactful-{datetime.now():%Y%m%d-%H%M%S}.parquet")
            recorder = Recorder(path)
            recorder.follow(self._session.feed, self._session.about())
            self._recorder, self._notice = recorder, f"recording {path}"

    def _stop_recording(self) -> None:
        recorder, self._recorder = self._recorder, None
        if recorder is not None:
            recorder.close()
            self._notice = recorder.problem or f"recorded {recorder.path}"

    def _wish_grab(self, link: int, point_m: Array, target_m: Array) -> None:
        if (shop := self._shop) is not None and 0 <= link < len(shop.shop.hands):

            def grab(_: Sample) -> None:
                shop.grab(link, point_m)
                shop.pull(target_m)

            self._session.ask(grab)

    def _wish_pull(self, target_m: Array) -> None:
        if (shop := self._shop) is not None:
            self._session.ask(lambda _: shop.pull(target_m))

    def _wish_let_go(self) -> None:
        if (shop := self._shop) is not None:
            self._session.ask(lambda _: shop.let_go())

    def _wish_put(self, obstacle_m: Array) -> None:
        if (shop := self._shop) is not None:
            self._session.ask(lambda _: shop.put(obstacle_m))

    def _wish_retune(self, config: MonitorConfig) -> None:
        if self._recorder is None:  # a recording holds one configuration
            self._session.ask(lambda _: self._session.monitor.retune(config))

    def _wish_react(self, name: str) -> None:
        if (reactor := self._session.reactor) is not None:
            config = reactor.config.model_copy(update={"rules": NAMED[name].rules})
            self._session.ask(lambda _: setattr(reactor, "config", config))

    def _wish_resume(self) -> None:
        if (reactor := self._session.reactor) is not None:
            self._session.ask(lambda sample: reactor.resume(sample.t, sample.q))  # type: ignore[arg-type]

    def _wish_keep(self) -> None:
        """Go on along the way that a hand has led last."""
        reactor, shop = self._session.reactor, self._shop
        if reactor is not None and shop is not None and reactor.taught:
            self._plan = plan = keep(reactor.taught, self._plan or shop.shop.plan, shop.cell.robot, shop.shop.posture)
            self._way_m = _way(plan)
            self._session.ask(lambda sample: reactor.follow(plan, sample.t, sample.q))  # type: ignore[arg-type]


def _way(plan: Rounds) -> Array:
    """Return where the tip is to go (k, 3) [m]."""
    return np.array([plan.path.pose(t).position_m for t in np.linspace(0, plan.path.end_s, 60)])


def _setup(session: Session, policy: str | None) -> Setup:
    source, monitor = session.source, session.monitor
    known: dict[str, Any] = {}
    if isinstance(source, SimSource):
        shop = source.shop
        known = {
            "obstacle_m": source.obstacle_m,
            "in_the_way_m": shop.in_the_way_m,
            "obstacle_size_m": OBSTACLE_SIZE_M,
            "way_m": _way(shop.plan),
            "speed": source.speed,
        }
    return Setup(
        source=source.name,
        robot=monitor.robot,
        model=session.monitor.config.robot.model,
        config=monitor.config,
        commanded=session.reactor is not None,
        workshop=isinstance(source, SimSource),
        policy=policy,
        **known,
    )
