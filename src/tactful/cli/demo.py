"""The verb that shows the monitor at work."""

import shlex
import time
from pathlib import Path
from typing import TYPE_CHECKING

from rich.console import Console
from rich.table import Table
from rich.text import Text

from tactful.cli.monitor import KIND_STYLES
from tactful.errors import TactfulError

if TYPE_CHECKING:
    from tactful.monitor import ContactEvent, Monitor, MonitorConfig
    from tactful.recordings import Recording
    from tactful.simulation import Episode, TrueContact

_SETTINGS = """\
# What the simulated arm is uncertain of; `tactful calibrate` measures it on a real one.
robot.model = "panda"

[noise]
velocity_rad_s = 0.001
torque_nm = 0.05
model_nm = 0.2
"""
_EARLY_S = 0.05
"""How much earlier than the touch a detection may come that still belongs to it [s]."""


def demo(*, out: Path = Path("tactful-demo"), seed: int = 0) -> int:
    """Monitor a simulated arm while it runs into a post and a hand helps it round.

    A Panda under compliant control moves in MuJoCo; the monitor gets its joint positions, velocities and torques one
    sample at a time. What it said stands beside the truth at the end. Needs tactful[mujoco].

    Args:
        out: The folder for the recording and the picture.
        seed: Where the post stands, how the hand pushes, and the noise of the sensors.

    Returns:
        0, or 1 if samples had to be skipped.
    """
    import numpy as np

    from tactful.monitor import Monitor, MonitorConfig
    from tactful.simulation import collision_and_help

    if seed < 0:
        raise TactfulError(f"--seed is {seed}: it is a whole number from 0 on")
    out.mkdir(parents=True, exist_ok=True)
    console = Console(highlight=False)
    with console.status("building the cell; the first time ever, kernels are compiled for about 20 s"):
        episode = collision_and_help(np.random.default_rng(seed))
        settings = out / "monitor.toml"
        settings.write_text(_SETTINGS, encoding="utf-8")
        watch = Monitor(episode.cell.robot, MonitorConfig.load(settings))
        watch.warm_up()
        episode.controller.warm_up()
    begin = time.perf_counter()
    events = _watch(episode, watch, console)
    took = time.perf_counter() - begin
    rate = 1 / episode.cell.config.period_s
    console.print(
        f"[dim]{episode.duration_s:g} s of the arm at {rate:g} Hz, simulated and monitored in {took:.1f} s[/dim]\n"
    )
    console.print(_table(events, episode))
    _show_files(episode.cell.recording(), out, watch.config, console)
    return int(watch.health.degraded)


def _watch(episode: "Episode", watch: "Monitor", console: Console) -> list["ContactEvent"]:
    """Monitor the episode while it runs, tell what happens when it does, and return every contact as known last."""
    latest: dict[int, ContactEvent] = {}
    for t, q, dq, tau in episode.run():
        event = watch.update(t, q, dq, tau)
        if event is not None:
            why = "" if event.phase == "ended" else _why(event, latest.get(event.id))
            latest[event.id] = event
            console.print(
                f"[dim]{t:6.3f} s[/dim]",
                Text(f"{event.kind} {event.phase}".replace("_", " ").ljust(19), style=KIND_STYLES[event.kind]),
                f"[dim]{why}[/dim]",
                soft_wrap=True,
            )
    return list(latest.values())


def _why(event: "ContactEvent", before: "ContactEvent | None") -> str:
    """Say what is new in an event."""
    if event.link is not None and event.location is not None and (before is None or before.link != event.link):
        return f"on {event.link}, P = {event.location.confidence:.3f}"
    return event.evidence[-1].text.partition(": ")[2] if event.evidence else "to be classified"


def _table(events: list["ContactEvent"], episode: "Episode") -> Table:
    """Return the true contacts, each with what was said of it below."""
    table = Table(box=None, pad_edge=False, header_style="dim")
    for heading in ("", "kind", "by"):
        table.add_column(heading)
    for heading in ("onset [s]", "detected", "end [s]", "peak [N]"):
        table.add_column(Text(heading), justify="right")
    contacts = [contact for contact in episode.cell.contacts if contact.visible_s is not None]
    pairs, extra = _paired(events, contacts)
    for contact, event in pairs:
        table.add_row("truth", *_truth(contact, episode.cell.robot.link_names))
        if event is None:
            table.add_row("monitor", Text("missed", style="yellow"))
        else:
            table.add_row("monitor", *_said(event, contact.touch_s))
    for event in extra:
        table.add_row("truth", Text("nothing", style="yellow"))
        table.add_row("monitor", *_said(event, event.onset_s))
    return table


def _paired(
    events: list["ContactEvent"], contacts: list["TrueContact"]
) -> tuple[list[tuple["TrueContact", "ContactEvent | None"]], list["ContactEvent"]]:
    """Give every contact the first event of which it is the latest cause; return the pairs and the events left over."""
    found: dict[int, ContactEvent] = {}
    extra = []
    for event in events:
        causes = [
            number
            for number, contact in enumerate(contacts)
            if contact.touch_s - _EARLY_S <= event.detected_s <= contact.end_s
        ]
        if causes and causes[-1] not in found:
            found[causes[-1]] = event
        else:
            extra.append(event)
    return [(contact, found.get(number)) for number, contact in enumerate(contacts)], extra


def _truth(contact: "TrueContact", links: tuple[str, ...]) -> tuple[str | Text, ...]:
    return (
        Text(contact.kind, style=KIND_STYLES[contact.kind]),
        f"{contact.name}, {links[contact.link]}",
        f"{contact.touch_s:.3f}",
        "",
        f"{contact.end_s:.3f}",
        f"{contact.peak_force_n:.1f}",
    )


def _said(event: "ContactEvent", touch_s: float) -> tuple[str | Text, ...]:
    return (
        Text(event.kind.replace("_", " "), style=KIND_STYLES[event.kind]),
        event.link or "",
        f"{event.onset_s:.3f}",
        f"{(event.detected_s - touch_s) * 1e3:+.0f} ms",
        "lasts" if event.end_s is None else f"{event.end_s:.3f}",
        f"{event.peak_force_n:.1f}",
    )


def _show_files(recording: "Recording", out: Path, settings: "MonitorConfig", console: Console) -> None:
    from tactful.monitor import Monitor
    from tactful.recordings import Recording

    file, picture = out / "demo.csv", out / "demo.png"
    recording.save(file)
    saved = [f"{file}  positions, velocities and torques; the truth is beside it, in {file.name}.labels.json"]
    try:
        Monitor(config=settings).run(Recording.read(file), trace=True).plot(picture)
        saved.append(f"{picture}  what the monitor saw: forces, their level, states")
    except TactfulError as error:
        saved.append(f"no picture: {error}")
    saved.append(f"{out / 'monitor.toml'}  the settings")
    command = shlex.join(
        ["tactful", "monitor", str(file), "--config", str(out / "monitor.toml"), "--plot", "again.png"]
    )
    for line in (
        "",
        "The monitor knows one contact at a time: it ends when the next begins, and its force is all that changed "
        "since the onset, smoothed by the observer.",
        "",
        *saved,
        "",
        f"The same from the recording:  {command}",
        f"What is in it:                {shlex.join(['tactful', 'info', str(file)])}",
    ):
        console.print(Text(line), soft_wrap=True)
