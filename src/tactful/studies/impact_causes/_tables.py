"""The study's figures in tables."""

from __future__ import annotations

from typing import Any

from tactful.studies.impact_causes._causes import TASKS

_TITLES = {"fixed": "a fixed, smooth surface", "rough": "a surface with friction", "object": "an object that gives way"}


def tables(summary: dict[str, Any]) -> str:
    """Return the tables as Markdown."""
    lines = ["# What went wrong with planned impacts, simulated", ""]
    for task in TASKS:
        for sensors, part in summary[task].items():
            right = part["right"]
            lines += [
                f"## The plan counts on {_TITLES[task]}; {sensors} sensors",
                "",
                f"Right: {right['value']:.1%} (95 % interval {right['low']:.1%} to {right['high']:.1%}). Inclination: "
                f"mean error {part['inclination_mae_deg']:.2f} deg, largest "
                f"{part['inclination_largest_error_deg']:.2f} deg.",
                "",
                *_confusion("was \\ told", part["confusion"]),
                "",
                *(
                    f"- {cause} is told wrongly at directions from {low:.0f} to {high:.0f} deg"
                    for cause, (low, high) in ((c, a) for c, a in part["wrong_alpha_deg"].items() if a)
                ),
                "",
                "| confidence | impacts that were felt | right |",
                "| --- | --- | --- |",
                *(f"| {b['from']:g}-{b['to']:g} | {b['runs']} | {b['right']:.0%} |" for b in part["confidence"]),
                "",
            ]
    rows = {f"{100 * row['held']:g} %": row["told"] for row in summary["partial"]}
    return "\n".join([*lines, "## Partial contact", "", *_confusion("held of the face \\ told", rows), ""])


def _confusion(corner: str, rows: dict[str, dict[str, int]]) -> list[str]:
    told = {name for row in rows.values() for name in row}
    order = [name for task in TASKS.values() for name in task.causes]
    columns = sorted(told, key=lambda name: order.index(name) if name in order else len(order))
    return [
        f"| {corner} | " + " | ".join(columns) + " |",
        "| --- |" + " --- |" * len(columns),
        *(
            f"| {name} | " + " | ".join(str(row.get(column, 0)) for column in columns) + " |"
            for name, row in rows.items()
        ),
    ]
