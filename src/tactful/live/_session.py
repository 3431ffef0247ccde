"""The loop: a sample in, the monitor, a torque out; all else happens elsewhere."""

from __future__ import annotations

import gc
import sys
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from tactful.live._durations import Durations
from tactful.live._feed import Feed
from tactful.live._source import ConnectionLostError, Sample, Source, SourceError, Traffic
from tactful.monitor import ContactEvent, Health, Monitor
from tactful.reaction import Plan, ReactionConfig, Reactor

_RETRY_S = 0.2
_REST_S = 2.0
"""Longest time in which a commanded arm is brought to rest [s]."""
_REST_RAD_S = 0.02
_SWITCH_S = 1e-4
"""How long another thread may keep the interpreter while the loop waits for it [s]; Python's own is 5 ms."""


class Step(NamedTuple):
    """One turn of the loop."""

    sample: Sample
    event: ContactEvent | None
    """What began, changed or ended with this sample."""
    reaction: str
    """What the arm does about its contacts; `continue` where it is not commanded."""


@dataclass(frozen=True, kw_only=True)
class Report:
    """How a run went."""

    source: str
    robot: str | None
    samples: int
    duration_s: float
    """On the source's clock, from the first sample to the last [s]."""
    lost: int
    """Samples that the source sent, or should have sent, and that did not come."""
    late: int | None
    """Samples that came more than two periods late; None where they come when they are asked for."""
    reconnects: int
    contacts: int
    computing_s: float
    """What the processor took for 99.9 % of the samples at most, nan without any [s]."""
    health: Health
    problem: str | None
    """Why the run ended before its time, None if it did not."""

    @property
    def degraded(self) -> bool:
        """Whether anything was lost, skipped or cut short."""
        return bool(self.lost or self.reconnects or self.problem or self.health.degraded)

    def __str__(self) -> str:
        """Say it in words."""
        parts = [f"{self.health}", f"{self.lost} lost"]
        if self.late is not None:
            parts.append(f"{self.late} late")
        if self.reconnects:
            parts.append(f"connected again {self.reconnects} time{'s' * (self.reconnects != 1)}")
        if self.samples:
            parts.append(f"99.9 % computed within {1e3 * self.computing_s:.2f} ms each")
        return ", ".join(parts)


class Session:
    """Monitor a source, and react.

    Each turn takes one sample through one call of `Monitor.update`; a commanded arm gets its torque before anything
    else happens. Readers of `feed` (the recorder, a printer, a view) never make the loop wait.

    A source that is lost is connected again for `reconnect_s`. An arm that was commanded is not: it has stopped by
    itself, and the run ends.

    Args:
        source: where the samples come from, with the settings of the monitor; the rate is that of the source.
        policy: what to do about contacts; None does nothing, and sources that can do without leave the arm alone.
        plan: where the tip of a commanded arm is to be; by default what the source says.
        reconnect_s: for how long a lost source is looked for [s].

    Attributes:
        monitor: the monitor, once `open` was called.
        reactor: what commands the arm, None where nothing does.
        feed: samples and events for readers, None before the first sample.
        computing: how long the processor computed for each sample, without what the source takes.
        turning: how long that took, with all that the machine did meanwhile.
    """

    def __init__(
        self,
        source: Source,
        *,
        policy: ReactionConfig | None = None,
        plan: Plan | None = None,
        reconnect_s: float = 10.0,
    ) -> None:
        self.source = source
        self.feed: Feed | None = None
        self.reactor: Reactor | None = None
        self.on_feed: list[Callable[[Feed], None]] = []
        """Called once with the feed, when the first sample is there."""
        self._policy, self._plan = policy, plan
        self._reconnect_s = reconnect_s
        self.computing, self.turning = Durations(), Durations()
        self._asked: deque[Callable[[Sample], None]] = deque()
        self._stopping = threading.Event()
        self._shift_s = 0.0
        self._first_s = self._last_s = float("nan")
        self._reconnects = 0
        self._contacts: set[int] = set()
        self._problem: str | None = None

    def open(self) -> None:
        """Connect, and compile what the loop needs.

        Raises:
            SourceError: if the source cannot be used.
            TactfulError: if the configuration does not fit it.
        """
        try:
            self.source.open()
            rate_hz = self.source.rate_hz
            self.monitor = Monitor(self.source.robot, self.source.config.fitted_to(rate_hz))
            self._traffic = Traffic(rate_hz, timed=self.source.timed)
            self.monitor.warm_up()
            if self.source.commanded:
                robot = self.monitor.robot
                assert robot is not None
                plan = self._plan or self.source.plan
                self.reactor = Reactor(robot, plan, self._policy, posture=self.source.posture)
                self.reactor.warm_up()
            self.source.begin()
        except BaseException:
            self.source.close()
            raise

    def stop(self) -> None:
        """Ask the loop to end, from any thread or a signal; a commanded arm is brought to rest first."""
        self._stopping.set()

    def ask(self, wish: Callable[[Sample], None]) -> None:
        """Let the loop do something short with the next sample, after the arm has got its torque; from any thread."""
        self._asked.append(wish)

    def about(self) -> dict[str, Any]:
        """Return what a recording says beside its samples."""
        robot = self.monitor.robot
        return {
            "source": self.source.name,
            "robot": robot.name if robot else None,
            "config": self.monitor.config.model_dump(mode="json"),
        }

    def pardon(self) -> None:
        """Do not count the next sample as late, nor any as lost before it: the source was paused."""
        self._traffic.restart()

    def run(self, duration_s: float | None = None) -> Report:
        """Go on until the source ends, `stop` is called, or `duration_s` of the source's time has passed."""
        for _ in self.steps(duration_s):
            pass
        return self.report

    def steps(self, duration_s: float | None = None) -> Iterator[Step]:
        """Yield every turn of the loop; see `run`."""
        resting_since: float | None = None
        try:
            with _undisturbed():
                while True:
                    sample = self._next()
                    if sample is None:
                        if self.source.ended or self._problem or (self._stopping.is_set() and self.reactor is None):
                            break
                        continue
                    step = self._turn(sample)
                    yield step
                    over = duration_s is not None and sample.t - self._first_s >= duration_s - 1e-9
                    if not (over or self._stopping.is_set()):
                        continue
                    if self.reactor is None:
                        break
                    if resting_since is None:
                        resting_since = sample.t
                        self.reactor.finish(sample.q)  # type: ignore[arg-type]
                    elif sample.t - resting_since >= _REST_S or _at_rest(sample):
                        break
        finally:
            self.close()

    def close(self) -> None:
        """Let go of the source, and tell the readers that nothing will follow."""
        self.source.close()
        if self.feed is not None:
            self.feed.close()

    @property
    def report(self) -> Report:
        """How the run went so far."""
        return Report(
            source=self.source.name,
            robot=self.monitor.robot.name if self.monitor.robot else None,
            samples=self._traffic.samples,
            duration_s=self._last_s - self._first_s if self._traffic.samples else 0.0,
            lost=max(self._traffic.lost, self.source.lost()),
            late=self._traffic.late if self.source.timed else None,
            reconnects=self._reconnects,
            contacts=len(self._contacts),
            computing_s=self.computing.quantile(0.999),
            health=self.monitor.health,
            problem=self._problem,
        )

    def _next(self) -> Sample | None:
        try:
            sample = self.source.read()
        except ConnectionLostError as error:
            self._look_for(error)
            return None
        if sample is not None and self._shift_s:
            sample = sample._replace(t=sample.t + self._shift_s)
        return sample

    def _turn(self, sample: Sample) -> Step:
        arrived, begun = time.perf_counter(), time.thread_time()
        if self._traffic.samples == 0:
            self._begin(sample)
        event = self.monitor.update(*sample[:4], tau_ext=sample.tau_ext, wrench=sample.wrench)
        reactor, reaction = self.reactor, "continue"
        if reactor is not None:
            t, q, dq = sample.t, sample.q, sample.dq
            if event is not None and not self._stopping.is_set():
                reactor.react(event, t, q)  # type: ignore[arg-type]
            self.source.command(reactor.torque(t, q, dq))  # type: ignore[arg-type]
            reaction = reactor.reaction
        self._traffic.count(sample.t, arrived)
        self._last_s = sample.t
        if event is not None:
            self._contacts.add(event.id)
        self.feed.put(sample, event)  # type: ignore[union-attr]
        while self._asked:
            self._asked.popleft()(sample)
        self.computing.add(time.thread_time() - begun)
        self.turning.add(time.perf_counter() - arrived)
        return Step(sample, event, reaction)

    def _begin(self, sample: Sample) -> None:
        self._first_s = sample.t
        self.feed = Feed(sample, self.source.rate_hz)
        for listener in self.on_feed:
            listener(self.feed)

    def _look_for(self, error: ConnectionLostError) -> None:
        """Connect again, or say why the run is over."""
        self._problem = str(error)
        if self.reactor is not None:
            return
        lost = time.monotonic()
        while not self._stopping.wait(_RETRY_S):
            try:
                self.source.close()
                self.source.open()
                self.source.begin()
                first = self.source.read()
            except SourceError as again:
                if time.monotonic() - lost > self._reconnect_s:
                    self._problem = f"{error}; not found again in {self._reconnect_s:g} s: {again.args[0]}"
                    return
                continue
            self._problem = None
            self._reconnects += 1
            self._traffic.restart()
            if first is not None and not first.t + self._shift_s > self._last_s:  # its clock began anew
                self._shift_s = self._last_s + (time.monotonic() - lost) - first.t
            return


def _at_rest(sample: Sample) -> bool:
    return bool(np.abs(sample.dq).max() < _REST_RAD_S)  # type: ignore[arg-type]


@contextmanager
def _undisturbed() -> Iterator[None]:
    """Keep the collector away from what lives long, and other threads from holding the interpreter."""
    before = sys.getswitchinterval()
    gc.collect()
    gc.freeze()
    sys.setswitchinterval(_SWITCH_S)
    try:
        yield
    finally:
        sys.setswitchinterval(before)
        gc.unfreeze()
