"""The study's figures as Markdown."""

from __future__ import annotations

from typing import Any

from tactful.studies.teaching._summary import Figures


def tables(summary: Figures) -> str:
    """Return the tables of a summary."""
    text = (
        "# Kinesthetic teaching\n\n"
        f"**From simulation**, seed {summary['seed']}, classifier {summary['classifier']}. A reference that leads onto "
        "the border of the hole, against the side of the box or onto its top is executed; where the arm gets stuck, "
        "one of six assumed operators leads the peg into the hole, once; then the merged reference is executed "
        "without help. Brackets: 95 %, Wilson.\n"
    )
    for sensors, figures in summary["presets"].items():
        rows = [("all", figures["all"]), *figures["by_trajectory"].items(), *figures["by_operator"].items()]
        text += f"\n## Sensors: {sensors} (simulation)\n\n"
        text += "| | peg inserted before | after one correction | executions |\n| --- | --- | --- | --- |\n"
        for name, rates in rows:
            text += f"| {name} | {_rate(rates['before'])} | {_rate(rates['after'])} | {rates['after']['total']} |\n"
        text += (
            f"\nOf the executions that failed, {_rate(figures['after_failure'])} succeeded after one correction. "
            f"Of {figures['helped']} touches of the operator, cooperation was told in {_rate(figures['recognised'])}"
            f", {_number(figures['latency_s']['median'], 2)} s after the touch in the median, and a demonstration was "
            f"merged in {_rate(figures['merged'])}; of these, the next execution inserted the peg in "
            f"{_rate(figures['after_merging'])}. Largest force of the cell on the arm, median: "
            f"{_number(figures['peak_before_n']['median'], 0)} N before, "
            f"{_number(figures['peak_after_n']['median'], 0)} N after.\n"
        )
    return text


def _rate(share: Any) -> str:
    if share["value"] is None:
        return "-"
    return f"{100 * share['value']:.0f} % [{100 * share['low']:.0f}, {100 * share['high']:.0f}]"


def _number(value: float | None, digits: int) -> str:
    return "-" if value is None else f"{value:.{digits}f}"
