"""The verb `info`."""

from __future__ import annotations

import json as jsonlib
from pathlib import Path

from rich.console import Console
from rich.padding import Padding
from rich.table import Table
from rich.text import Text

from tactful.recordings import Recording, Summary, summarize


def info(files: list[Path], /, *, mapping: str | None = None, json: bool = False) -> None:
    """Say what is in recordings, what can be monitored with them, and where they may mislead.

    Args:
        files: Recordings: CSV, Parquet, NPZ, JSON, or the logs of libfranka and panda-py.
        mapping: A TOML file that says which column is what, or the name of a layout that comes with Tactful.
        json: Print one JSON object a line for every file, and nothing else.
    """
    console = Console(highlight=False)
    for file in files:
        summary = summarize(Recording.read(file, mapping=mapping))
        if json:
            print(jsonlib.dumps(summary.to_dict()))
        else:
            _show(summary, console)


def _show(summary: Summary, console: Console) -> None:
    quality = summary.quality
    joints = "" if summary.joints is None else f", {summary.joints} joints"
    console.print()
    console.print(Text(summary.source, style="bold"))
    _line(
        console,
        f"{summary.format}, {summary.rows} rows, {summary.duration_s:.3f} s at {summary.rate_hz:.1f} Hz{joints}",
    )

    _title(console, "Channels")
    grid = Table.grid(padding=(0, 2))
    for _ in range(3):
        grid.add_column()
    grid.add_column(justify="right")
    grid.add_column(justify="right")
    grid.add_column()
    for channel in summary.channels:
        grid.add_row(
            Text(channel.name, style="cyan"),
            f"{channel.columns}",
            Text(channel.title, style="dim"),
            f"{channel.smallest:.4g}",
            f"{channel.largest:.4g}",
            " ".join(dict.fromkeys(channel.units))
            + (f"   {channel.nonfinite} not finite" if channel.nonfinite else ""),
        )
    console.print(Padding(grid, (0, 0, 0, 2), expand=False))

    _title(console, "Time")
    step = f"step {1e3 * quality.median_step_s:.4g} ms, jitter {1e3 * quality.jitter_s:.2g} ms"
    _line(console, f"{step}, from {1e3 * quality.shortest_step_s:.4g} to {1e3 * quality.longest_step_s:.4g} ms")
    gaps = f"{quality.gaps} gaps" + (f" (longest {quality.longest_gap_s:.4g} s)" if quality.gaps else "")
    _line(
        console,
        f"{gaps}, {quality.repeated_rows} repeated rows, {quality.repeated_stamps} repeated stamps, "
        f"{quality.backward_steps} backward, {quality.nonfinite_rows} not finite",
    )
    low, high = summary.band_hz
    _line(console, f"carries {low:.3g} to {high:.4g} Hz in a window of {summary.window_s:.3g} s (1/window to rate/2)")

    _title(console, "Can be monitored")
    grid = Table.grid(padding=(0, 2))
    for ability in summary.abilities:
        mark = Text("yes", style="green") if ability.possible else Text("no", style="yellow")
        grid.add_row(ability.step, mark, Text(ability.how, style="dim"))
    console.print(Padding(grid, (0, 0, 0, 2), expand=False))

    counts = [f"{count} {kind}" for kind, count in summary.label_counts.items()]
    for title, lines, style in (
        ("Labels", [", ".join(counts)] if counts else [], ""),
        ("Traps", summary.traps, "yellow"),
        ("Notes", summary.notes, "dim"),
    ):
        if lines:
            _title(console, title)
            for line in lines:
                _line(console, line, style)


def _title(console: Console, text: str) -> None:
    console.print()
    console.print(Text(text, style="bold"))


def _line(console: Console, text: str, style: str = "") -> None:
    console.print(Padding(Text(text, style=style), (0, 0, 0, 2), expand=False))
