"""What was measured, as tables."""

from __future__ import annotations

from typing import Any

from rich.console import Console
from rich.table import Table

BOUNDS: tuple[tuple[str, str, str, str, float], ...] = (
    ("chain_batch_us", "whole chain in batch", "µs/sample", "≤", 2.5),
    ("chain_stream_us", "whole chain, streaming from Python", "µs/call", "≤", 6.0),
    ("ratio_pinocchio_batch", "against Pinocchio's Python calls, batch", "times", "≥", 20.0),
    ("ratio_pinocchio_stream", "against Pinocchio's Python calls, streaming", "times", "≥", 12.0),
    ("ratio_mujoco_batch", "against MuJoCo's Python functions, batch", "times", "≥", 12.0),
    ("locate_us", "where a contact is, a look every 10 ms", "µs/call", "≤", 150.0),
    ("hour_s", "an hour at 1 kHz from Parquet, whole process", "s", "<", 15.0),
    ("hour_peak_gb", "its memory at most", "GB", "<", 2.0),
    ("cli_s", "tactful monitor on 10 s", "s", "<", 2.5),
    ("cli_first_s", "its first call ever, which compiles", "s", "<", 25.0),
    ("import_s", "import tactful", "s", "<", 0.5),
    ("ratio_real_time", "simulated episodes, robot time over time of a core", "times", "≥", 8.0),
)
_PARTS = {
    "place": "place the links",
    "momentum_terms": "momentum terms",
    "observer": "observer",
    "jacobian": "Jacobian of the tip",
    "wrench": "wrench",
    "sliding_dft": "sliding DFT, 3 axes",
    "rest": "all else",
}


def report(result: dict[str, Any], console: Console) -> None:
    """Print the tables."""
    table = _table("Bounds", "", "measured", "bound", "")
    for key, name, unit, sign, bound in BOUNDS:
        value = result[key]
        if value is None:
            table.add_row(name, "not measured", f"{sign} {bound:g} {unit}", "")
            continue
        held = value >= bound if sign == "≥" else value <= bound
        table.add_row(
            name, f"{value:.3g}", f"{sign} {bound:g} {unit}", "[green]holds" if held else "[red]does not hold"
        )
    console.print(table)
    _peers(result, console)
    table = _table("Parts of the chain", "", "µs/sample")
    for name, us in result["parts_us"].items():
        table.add_row(_PARTS[name], f"{us:.2f}")
    console.print(table)
    table = _table("A step of the 1 kHz loop", "", "p50", "p99", "p99.9", "max")
    for words, times in (("by the clock", result["loop_us"]), ("on the processor", result["loop_us"]["cpu"])):
        table.add_row(words, *(f"{times[key]:.1f} µs" for key in ("p50", "p99", "p99_9", "max")))
    console.print(table)


def _peers(result: dict[str, Any], console: Console) -> None:
    table = _table("The same chain with its peers", "", "µs/sample", "times batch", "times streaming")
    table.add_row("Tactful, whole chain", f"{result['chain_batch_us']:.2f}", "1", "")
    table.add_row("  sample by sample", f"{result['chain_stream_us']:.2f}", "", "1")
    table.add_row("  mode fast instead of paper", f"{result['fast_batch_us']:.2f}", "", "")
    table.add_row("  sample by sample", f"{result['fast_stream_us']:.2f}", "", "")
    for key, name in (("pinocchio", "Pinocchio"), ("mujoco", "MuJoCo")):
        for part, words in (("", f"{name} and numpy, whole chain"), ("_estimate", "  observer and wrench alone")):
            if result[f"{key}{part}_us"] is None:
                table.add_row(words, "not installed", "", "")
            else:
                ratios = (f"{result[f'ratio_{key}{part}_{way}']:.1f}" for way in ("batch", "stream"))
                table.add_row(words, f"{result[f'{key}{part}_us']:.1f}", *ratios)
    console.print(table)


def _table(title: str, *columns: str) -> Table:
    table = Table(title=title, title_justify="left", title_style="bold", box=None, pad_edge=False, header_style="dim")
    for column in columns:
        table.add_column(column, justify="left" if column == "" else "right")
    return table
