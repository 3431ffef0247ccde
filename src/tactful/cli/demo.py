"""The verb that shows the monitor at work."""

import shlex
import time
from importlib import resources
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

from rich.console import Console
from rich.table import Table
from rich.text import Text

from tactful.cli._demo_impact import demo_impact
from tactful.cli.monitor import KIND_STYLES
from tactful.errors import TactfulError

if TYPE_CHECKING:
    from tactful.monitor import ContactEvent, MonitorConfig
    from tactful.recordings import Recording
    from tactful.simulation import Execution, TrueContact

_EARLY_S = 0.05
"""How much earlier than the touch a detection may come that still belongs to it [s]."""


def demo(*, out: Path = Path("tactful-demo"), seed: int = 0, impact: bool = False) -> int:
    """Monitor a simulated arm while it runs into a box, while a hand helps it, and while it does what it was shown.

    A Panda with a peg under compliant control moves in MuJoCo; the monitor gets its joint positions, velocities and
    torques one sample at a time, and tells the arm what touches it. What it said stands beside the truth at the end.
    Needs tactful[mujoco,teach].

    Args:
        out: The folder for the recordings and the picture.
        seed: Where box and arm stand, how the hand leads, and the noise of the sensors.
        impact: Show planned impacts of a planar arm instead, one as expected and one not.

    Returns:
        0, or 1 if samples had to be skipped or the peg was not inserted.
    """
    from tactful.monitor import Monitor, MonitorConfig
    from tactful.reaction import merge
    from tactful.simulation import EpisodeSpec, Lesson

    if seed < 0:
        raise TactfulError(f"--seed is {seed}: it is a whole number from 0 on")
    if impact:
        return demo_impact(out, seed)
    if find_spec("mujoco") is None:
        raise TactfulError('the demo needs MuJoCo: pip install "tactful[mujoco]"')
    out.mkdir(parents=True, exist_ok=True)
    console = Console(highlight=False)
    with console.status("building the cell; the first time ever, kernels are compiled for about 30 s"):
        lesson = Lesson(
            EpisodeSpec(kind="collision_then_cooperation", trajectory="side", operator="leading", seed=seed)
        )
        settings = out / "monitor.toml"
        settings.write_bytes((resources.files("tactful.simulation") / "presets" / "clean-monitor.toml").read_bytes())
        config = MonitorConfig.load(settings)
        watches = [Monitor(config=config) for _ in range(2)]
        watches[0].warm_up()
        lesson.warm_up()
    begin = time.perf_counter()
    console.print("An arm is to insert a peg; its reference leads against the side of the box, until a hand helps.")
    latest: dict[int, ContactEvent] = {}

    def show(t: float, event: "ContactEvent") -> None:
        why = "" if event.phase == "ended" else _why(event, latest.get(event.id))
        latest[event.id] = event
        console.print(
            f"[dim]{t:6.3f} s[/dim]",
            Text(f"{event.kind} {event.phase}".replace("_", " ").ljust(19), style=KIND_STYLES[event.kind]),
            f"[dim]{why}[/dim]",
            soft_wrap=True,
        )

    first = lesson.execute(lesson.plan, lesson.end_s, watches[0], helped=True, on_event=show)
    executions = {"The first execution": first}
    if find_spec("movement_primitives") is None:
        console.print('\nTo execute what the hand showed: pip install "tactful\\[teach]"')
    else:
        console.print("\nWhat the hand showed is merged into the reference, and that is executed without help.")
        latest.clear()
        taught = merge(lesson.plan, first.reactor.taught, lesson.robot, lesson.scene.q)
        again = lesson.execute(taught.pose, taught.end_s, watches[1], helped=False, on_event=show)
        executions["The next one"] = again
    took = time.perf_counter() - begin
    robot_s = sum(execution.cell.t for execution in executions.values())
    console.print(f"[dim]{robot_s:.1f} s of the arm at 1000 Hz, simulated and monitored in {took:.1f} s[/dim]")
    for title, execution in executions.items():
        console.print(Text(f"\n{title}: {_outcome(execution)}"), soft_wrap=True)
        console.print(_table(list(execution.events), execution))
    recordings = [execution.cell.recording() for execution in executions.values()]
    _show_files(recordings, out, config, console)
    degraded = any(watch.health.degraded for watch in watches)
    return int(degraded or not all(execution.inserted for execution in executions.values()))


def _outcome(execution: "Execution") -> str:
    peg = "in the hole" if execution.inserted else "not in the hole"
    if execution.stuck_s is None:
        return f"the peg is {peg}, without help"
    return f"the arm was stuck at {execution.stuck_s:.1f} s; with help the peg is {peg}"


def _why(event: "ContactEvent", before: "ContactEvent | None") -> str:
    """Say what is new in an event."""
    if event.link is not None and event.location is not None and (before is None or before.link != event.link):
        return f"on {event.link}, P = {event.location.confidence:.3f}"
    return event.decision.partition(": ")[2] or "to be classified"


def _table(events: list["ContactEvent"], execution: "Execution") -> Table:
    """Return the true contacts, each with what was said of it below."""
    table = Table(box=None, pad_edge=False, header_style="dim")
    for heading in ("", "kind", "by"):
        table.add_column(heading)
    for heading in ("onset [s]", "detected", "end [s]", "peak [N]"):
        table.add_column(Text(heading), justify="right")
    contacts = [contact for contact in execution.cell.contacts if contact.visible_s is not None]
    pairs, extra = _paired(events, contacts)
    for contact, event in pairs:
        table.add_row("truth", *_truth(contact, execution.cell.robot.link_names))
        if event is None:
            table.add_row("monitor", Text("missed", style="yellow"))
        else:
            table.add_row("monitor", *_said(event, contact.touch_s))
    for event in extra:
        lasting = [contact.name for contact in contacts if contact.touch_s <= event.detected_s <= contact.end_s]
        text = f"still {' and '.join(lasting)}" if lasting else "nothing"
        table.add_row("truth", Text(text, style="" if lasting else "yellow"))
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


def _show_files(recordings: list["Recording"], out: Path, settings: "MonitorConfig", console: Console) -> None:
    from tactful.monitor import Monitor
    from tactful.recordings import Recording

    file, picture = out / "demo.csv", out / "demo.png"
    recordings[0].save(file)
    saved = [f"{file}  positions, velocities and torques; the truth is beside it, in {file.name}.labels.json"]
    for recording in recordings[1:]:
        recording.save(out / "taught.csv")
        saved.append(f"{out / 'taught.csv'}  the same of the next execution")
    try:
        Monitor(config=settings).run(Recording.read(file), trace=True).plot(picture)
        saved.append(f"{picture}  what the monitor saw: forces, their level, states")
    except TactfulError as error:
        saved.append(f"no picture: {error}")
    saved.append(f"{out / 'monitor.toml'}  the settings, as `tactful calibrate` found them on a minute of free motion")
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
