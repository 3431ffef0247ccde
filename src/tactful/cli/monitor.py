"""The verb that monitors recordings."""

import json
import time
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter
from rich.console import Console
from rich.padding import Padding
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn
from rich.text import Text

from tactful.cli._settings import Mode, load_settings

if TYPE_CHECKING:
    from tactful.monitor import ContactEvent, Monitor, MonitorConfig, Timeline
    from tactful.recordings import Recording

KIND_STYLES = {
    "contact": "bold",
    "collision": "bold red",
    "cooperation": "bold green",
    "expected_impact": "bold blue",
    "unexpected_impact": "bold magenta",
}


def monitor(
    file: Annotated[list[Path], Parameter(negative_iterable=())],
    /,
    *,
    robot: str | None = None,
    tip: str | None = None,
    config: Path | None = None,
    mapping: Path | None = None,
    mode: Mode | None = None,
    plan: Path | None = None,
    causes: Path | None = None,
    json: bool = False,
    plot: Path | None = None,
    save: Path | None = None,
) -> int:
    """Find the contacts in recordings, and say of each since when, how hard, and what it is.

    Args:
        file: Recordings of any format that `tactful info` knows.
        robot: The arm: a name from `tactful robots`, or an MJCF or URDF file. Not needed where a wrench was recorded.
        tip: The frame at which the force is estimated: a site or link of the robot.
        config: Settings, a TOML file.
        mapping: What the columns of the recordings mean, a TOML file.
        mode: The detector. `fast`, the default, looks at the external torque against the noise of the arm; `paper` at
            the frequency content of the external force.
        plan: An impact that is intended, as `ImpactPlan.save` wrote it: around it, impacts are expected or not.
        causes: What may go wrong with it, as `ImpactCauses.save` wrote it: the reason of an unexpected impact.
        json: Print one JSON object a line for every contact, and nothing else, on standard output.
        plot: Save a picture (.png, .svg, .pdf). Of several recordings, each has its name added.
        save: Save the contacts (.parquet, .jsonl). Of several recordings, each has its name added.

    Returns:
        0, or 1 if samples had to be skipped.
    """
    settings = load_settings(config, robot=robot, tip=tip, mode=mode)
    degraded = False
    for path in file:
        timeline = _monitor(path, mapping, settings, plan, causes, trace=plot is not None)
        degraded = degraded or timeline.health.degraded
        if json:
            _print_json(path, timeline)
        else:
            _print_table(timeline)
        for target, write in ((plot, timeline.plot), (save, timeline.save)):
            if target is not None:
                named_target = (
                    target if len(file) == 1 else target.with_name(f"{target.stem}_{path.stem}{target.suffix}")
                )
                write(named_target)
                Console(stderr=True).print(f"[dim]saved {named_target}[/dim]", highlight=False)
    return int(degraded)


def _monitor(
    path: Path, mapping: Path | None, settings: "MonitorConfig", plan: Path | None, causes: Path | None, *, trace: bool
) -> "Timeline":
    from tactful.classification import ImpactCauses
    from tactful.errors import TactfulError
    from tactful.impacts import ImpactPlan
    from tactful.monitor import Monitor
    from tactful.recordings import Recording

    console = Console(stderr=True)
    with console.status(f"reading {path.name}"):
        recording = Recording.read(path, mapping=mapping)
    if recording.notes:
        count = len(recording.notes)
        console.print(
            f"[dim]{count} note{'s' * (count != 1)} on how {path.name} was read: tactful info {path}[/dim]",
            highlight=False,
            soft_wrap=True,
        )
    if settings.robot.model is None and recording.q is not None and recording.wrench is None:
        raise TactfulError(
            f"{path}: which arm was recorded? Name it: --robot, one of `tactful robots`, or an MJCF or URDF file"
        )
    expected = None if plan is None else ImpactPlan.load(plan)
    learnt = None if causes is None else ImpactCauses.load(causes)
    watch = Monitor(config=settings.fitted_to(recording.rate_hz), plan=expected, causes=learnt)
    watch.accept(recording)  # before the kernels, which may take their time
    _load_kernels(watch, console)
    return _run(watch, recording, console, trace=trace)


def _load_kernels(watch: "Monitor", console: Console) -> None:
    begin = time.perf_counter()
    with console.status("loading the kernels; the first time they are compiled, which takes about 15 s"):
        compiled = watch.warm_up(stream=False)
    if compiled:
        console.print(
            f"[dim]compiled the kernels in {time.perf_counter() - begin:.0f} s, once for all calls[/dim]",
            highlight=False,
        )


def _run(watch: "Monitor", recording: "Recording", console: Console, *, trace: bool) -> "Timeline":
    columns = (TextColumn("monitoring"), BarColumn(), TextColumn("{task.percentage:3.0f} %"), TimeRemainingColumn())
    with Progress(*columns, console=console, transient=True) as bar:
        task = bar.add_task("", total=len(recording.t))
        return watch.run(recording, trace=trace, progress=lambda taken: bar.update(task, completed=taken))


def _print_json(path: Path, timeline: "Timeline") -> None:
    for event in timeline:
        print(json.dumps({"recording": str(path), **event.to_dict()}, allow_nan=False))


def _print_table(timeline: "Timeline") -> None:
    console = Console()
    config = timeline.config
    low, high = config.frequency.band_hz
    detector = (
        "fast detector"
        if config.mode == "fast"
        else f"band {low:.3g}-{high:.3g} Hz over {config.frequency.window} samples"
    )
    console.print(
        Text.assemble(
            (Path(timeline.source).name, "bold"),
            f"  {timeline.robot or 'no robot, wrench alone'}, {timeline.end_s - timeline.start_s:.1f} s "
            f"at {config.rate_hz:.4g} Hz, {detector}",
        )
    )
    if not len(timeline):
        console.print("no contact", style="green")
    else:
        _print_contacts(timeline, console)
    if timeline.health.degraded:
        console.print(f"degraded: {timeline.health}", style="yellow", highlight=False)
    else:
        console.print(f"{timeline.health}", style="dim", highlight=False)
    _print_bias(timeline, console)


def _print_bias(timeline: "Timeline", console: Console) -> None:
    unit = "Nm" if timeline.robot else "N, Nm"
    bound = [
        i
        for i, (b, limit) in enumerate(zip(timeline.bias_nm, timeline.bias_limit_nm, strict=True))
        if abs(b) >= limit > 0
    ]
    if bound:
        told = ", ".join(f"{i + 1} ({timeline.bias_nm[i]:+.2f} {unit})" for i in bound)
        console.print(
            f"the bias of channel {told} is at its bound: calibrate anew, or name the tool that was changed",
            style="yellow",
            highlight=False,
        )
    elif any(timeline.bias_nm):
        largest = max(timeline.bias_nm, key=abs)
        console.print(
            f"bias followed while nothing touched: at most {abs(largest):.2g} {unit}", style="dim", highlight=False
        )


_HEADINGS = ("onset [s]", "detected", "lasts [s]", "kind", "sure", "force [N]", "where")
_LEFT = ("kind", "where")


def _print_contacts(timeline: "Timeline", console: Console) -> None:
    """Print a line for each contact, and below it what decided."""
    rows = [_cells(event) for event in timeline]
    widths = [max(map(len, column)) for column in zip(_HEADINGS, *rows, strict=True)]
    console.print(_line(_HEADINGS, widths), style="dim", soft_wrap=True)
    for event, row in zip(timeline, rows, strict=True):
        line = _line(row, widths)
        line.highlight_words([event.kind.replace("_", " ")], KIND_STYLES[event.kind])
        console.print(line, highlight=False, soft_wrap=True)
        console.print(Padding(Text(_why(event), style="dim"), (0, 0, 0, widths[0] + 1)))
    if any(event.damped for event in timeline):
        console.print("* near a singularity: the force may be too small", style="dim", highlight=False)


def _line(cells: Sequence[str], widths: Sequence[int]) -> Text:
    parts = [
        cell.ljust(width) if heading in _LEFT else cell.rjust(width)
        for heading, cell, width in zip(_HEADINGS, cells, widths, strict=True)
    ]
    return Text("  ".join(parts).rstrip())


def _cells(event: "ContactEvent") -> tuple[str, ...]:
    return (
        f"{event.onset_s:.3f}",
        f"+{(event.detected_s - event.onset_s) * 1e3:.0f} ms",
        "still" if event.end_s is None else f"{event.end_s - event.onset_s:.2f}",
        event.kind.replace("_", " "),
        f"{event.confidence:.2f}",
        f"{event.peak_force_n:.1f}" + ("*" if event.damped else ""),
        _where(event),
    )


def _why(event: "ContactEvent") -> str:
    """Say which rule decided, and what counted most."""
    said = [evidence.text for evidence in event.evidence[:2]]
    said[:1] = [text.partition(": ")[2] or text for text in said[:1]]
    why = "; ".join(said)
    return f"{event.reason}: {why}" if event.reason is not None and event.reason not in why else why


def _where(event: "ContactEvent") -> str:
    """Say the link or, where none is sure, the part of the arm."""
    location = event.location
    if event.link is not None:
        return event.link
    if location is None:
        return ""
    return "more than one?" if location.several else f"{location.region}?"
