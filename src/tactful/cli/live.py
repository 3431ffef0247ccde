"""The verb that monitors a running arm."""

import json as jsonlib
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from rich.console import Console
from rich.text import Text

from tactful.cli._settings import Mode, load_settings
from tactful.cli.monitor import KIND_STYLES

if TYPE_CHECKING:
    from tactful.live import Feed, Recorder, Report, Session, Source
    from tactful.live.view import View
    from tactful.monitor import ContactEvent
    from tactful.reaction import ReactionConfig

_LOOK_S = 0.05


def live(
    *,
    source: str,
    robot: str | None = None,
    tip: str | None = None,
    config: Path | None = None,
    mode: Mode | None = None,
    react: str | None = None,
    record: Path | None = None,
    duration: float | None = None,
    speed: float = 1.0,
    mapping: Path | None = None,
    json: bool = False,
    view: bool = False,
    port: int = 8080,
) -> int:
    """Monitor a running arm, tell its contacts as they come, and react to them if wanted.

    Ctrl-C ends it. Reactions lower contact forces; they are not a certified safety function and replace none.

    Args:
        source: sim, replay:FILE, franka://HOST, ros2:/TOPIC or ur://HOST.
        robot: The arm: a name from `tactful robots`, or an MJCF or URDF file.
        tip: The frame at which the force is estimated: a site or link of the robot.
        config: Settings of the monitor, a TOML file.
        mode: The detector, `fast` or `paper`, see `tactful monitor`.
        react: What to do about contacts: stop, retract, comply, teach, continue, or a TOML file with rules. The arm
            (franka://) is then commanded from here, and holds where it is; without it, it is only listened to.
        record: Record samples, settings and events (.parquet). After a crash it opens all the same.
        duration: End after this time of the source [s].
        speed: Of sim and replay: robot time that passes in a second; 0 is as fast as it goes.
        mapping: Of replay: what the columns of the recording mean, a TOML file.
        json: Print one JSON object a line for every event, and nothing else, on standard output.
        view: Show the arm, its contacts and the signals on a page in the browser. With sim, the arm can be touched
            there; with replay:, the recording is played and scrubbed.
        port: Where the page is served, on this machine alone; 0 takes any port that is free.

    Returns:
        0, or 1 if samples were lost or skipped, or the run ended before its time.
    """
    from tactful.errors import TactfulError
    from tactful.live import open_source
    from tactful.reaction import load_policy

    if duration is not None and not 0 < duration < float("inf"):
        raise TactfulError(f"--duration is {duration:g}: give a time above 0 [s]")
    settings = load_settings(config, robot=robot, tip=tip, mode=mode)
    policy = None if react is None else load_policy(react)
    origin = open_source(source, settings, react=policy is not None, speed=speed, mapping=mapping)
    console = Console(stderr=True, highlight=False)
    if view:
        from tactful.cli._live_page import run_in_page

        return run_in_page(
            origin,
            policy,
            port=port,
            react=react,
            record=record,
            duration_s=duration,
            speed=speed,
            mapping=mapping,
            json=json,
            console=console,
        )
    return run_once(origin, policy, record=record, duration_s=duration, json=json, console=console)


def run_once(
    origin: "Source",
    policy: "ReactionConfig | None",
    *,
    record: Path | None,
    duration_s: float | None,
    json: bool,
    console: Console,
    view: "View | None" = None,
    shown_policy: str | None = None,
) -> int:
    """Monitor a source to its end, and return the exit code."""
    from tactful.live import Recorder, Session

    session = Session(origin, policy=policy)
    teller = _Teller(origin, json=json)
    session.on_feed.append(teller.follow)
    recorder = None if record is None else Recorder(record)
    if recorder is not None:
        session.on_feed.append(lambda feed: recorder.follow(feed, session.about()))
    with _stopping(session):
        try:
            with console.status(
                f"connecting to {origin.name}; the first time ever, kernels are compiled for about 20 s"
            ):
                session.open()
            arm = session.monitor.robot
            console.print(
                f"[dim]{origin.name}: {arm.title if arm else 'no robot, wrench alone'}, {origin.rate_hz:g} Hz, "
                f"{'commanded from here' if origin.commanded else 'listened to'}; Ctrl-C ends it[/dim]",
                soft_wrap=True,
            )
            if view is not None:
                view.follow(session, shown_policy)
            report = session.run(duration_s)
        finally:
            session.close()
            teller.finish()
            if recorder is not None:
                recorder.close()
    return _tell_end(report, recorder, console)


@contextmanager
def _stopping(session: "Session") -> Iterator[None]:
    """End the session in order on Ctrl-C and SIGTERM; a second one ends it at once."""

    def stop(number: int, _: object) -> None:
        session.stop()
        signal.signal(number, signal.default_int_handler)

    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = {number: signal.signal(number, stop) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


class _Teller:
    """Tells events on standard output and at the source's side, in a thread of its own."""

    def __init__(self, source: "Source", *, json: bool) -> None:
        self._source = source
        self._say: Callable[[float, ContactEvent], None] = self._print_json if json else self._print
        self._console = Console(highlight=False)
        self._thread: threading.Thread | None = None
        self._done = threading.Event()

    def follow(self, feed: "Feed") -> None:
        """Begin to tell what a feed brings."""
        self._thread = threading.Thread(target=self._follow, args=(feed,), name="tactful-teller", daemon=True)
        self._thread.start()

    def finish(self) -> None:
        """Tell what is left."""
        self._done.set()
        if self._thread is not None:
            self._thread.join()

    def _follow(self, feed: "Feed") -> None:
        subscription = feed.subscribe()
        last = False
        while not last:
            last = self._done.wait(_LOOK_S) or feed.closed
            for t, event in subscription.read().events:
                self._source.tell(event)
                self._say(t, event)

    def _print_json(self, t: float, event: "ContactEvent") -> None:
        print(jsonlib.dumps({"source": self._source.name, "t": t, **event.to_dict()}, allow_nan=False), flush=True)

    def _print(self, t: float, event: "ContactEvent") -> None:
        told = event.decision.partition(": ")[2] or "to be classified"
        self._console.print(
            f"[dim]{t:8.3f} s[/dim]",
            Text(f"{event.kind} {event.phase}".replace("_", " ").ljust(19), style=KIND_STYLES[event.kind]),
            f"{event.peak_force_n:5.1f} N",
            Text("" if event.phase == "ended" else told, style="dim"),
            soft_wrap=True,
        )


def _tell_end(report: "Report", recorder: "Recorder | None", console: Console) -> int:
    if report.problem is not None:
        console.print(Text(f"ended before its time: {report.problem}", style="yellow"), soft_wrap=True)
    problem = None
    if recorder is not None and report.samples:
        missed = f"{recorder.missed} samples came too fast for the disk" if recorder.missed else None
        problem = recorder.problem or missed
        console.print(
            Text(problem, style="yellow") if problem else f"[dim]recorded {recorder.path}[/dim]", soft_wrap=True
        )
    degraded = report.degraded or problem is not None
    contacts = f"{report.contacts} contact{'s' * (report.contacts != 1)}"
    console.print(
        Text(f"{contacts} in {report.duration_s:.1f} s: {report}", style="yellow" if degraded else "dim"),
        soft_wrap=True,
    )
    sys.stdout.flush()
    return int(degraded)
