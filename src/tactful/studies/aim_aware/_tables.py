"""The study's figures in tables."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from tactful.studies._report import Table, targets_table
from tactful.studies.aim_aware._targets import band_text

Figures = dict[str, Any]

PAPER: Mapping[str, tuple[str, str, str]] = {
    name: (band, "about 2", "0 %") for name, band in (("strict", "0"), ("medium", "[-2, 2]"), ("wide", "[-4, 4]"))
}
"""What the paper says of its sets: always accepted [deg], ambiguous on each side [deg], accepted beyond."""
_TITLES = {"table1": "Tab. 1 verbatim", "tuned": "tuned", "tilt": "tuned, with the tilt", "raw": "raw error, tuned"}


def bands_table(summary: Figures) -> Table:
    """Return the bands of every set, on the grid and held out, beside what the paper says."""
    heading = ("set", "paper: band [deg]", "ambiguous", "beyond", "grid: band [deg]", "ambiguous", "beyond")
    rows = []
    for group, title in _TITLES.items():
        for name, said in PAPER.items():
            if name in summary[group]:
                found = summary[group][name]
                rows.append((f"{title}, {name}", *said, *_cells(found), *_cells(found["held_out"])))
    return Table((*heading, "held out: band", "ambiguous", "beyond"), rows)


def robustness_table(summary: Figures) -> Table:
    """Return what is kept of the bands where something differs from the assumed arm."""
    names = [(group, name) for group in ("tuned", "tilt") for name in PAPER if (group, name) != ("tilt", "strict")]
    heading = [f"{name}{', with the tilt' if group == 'tilt' else ''}" for group, name in names]
    rows = []
    for row in summary["robustness"]:
        found = [row[group][name] for group, name in names]
        rows.append((row["variant"], *(", ".join(_cells(x)) if "rate" in x else "not to be tuned" for x in found)))
    return Table(("variant: band, ambiguous, beyond", *heading), rows)


def tables(summary: Figures) -> str:
    """Return the tables as Markdown."""
    return "\n".join(
        [
            "# Expected or unexpected impact, simulated",
            "",
            *intro(summary),
            "",
            *_markdown(bands_table(summary)),
            "",
            "## Tuned anew on what differs; held-out impacts",
            "",
            *_markdown(robustness_table(summary)),
            "",
            "## Targets",
            "",
            *_markdown(targets_table(summary["targets"])),
            "",
        ]
    )


def intro(summary: Figures) -> list[str]:
    """Return what the figures are of."""
    late, wait = summary["verdict_after_first_impact_s"], summary["verdict_after_last_impact_s"]
    return [
        f"{summary['impacts']} impacts of the grid {summary['grid']!r}: {summary['cpu_s']:.0f} s of CPU to simulate "
        "and judge them. Held out: approaches and places that nothing was tuned on, inclinations every 0.25 deg.",
        f"Inclination from the tip in contact, held out, within ±8 deg: mean error {summary['inclination_mae_deg']:.2g}"
        f" deg, worst {summary['inclination_worst_deg']:.2g} deg. The verdict comes {1e3 * wait['largest']:.0f} ms "
        f"after the last impact; after the first one, median {1e3 * late['median']:.0f} ms, 95 % within "
        f"{1e3 * late['p95']:.0f} ms.",
    ]


def _markdown(table: Table) -> list[str]:
    lines = ["| " + " | ".join(row) + " |" for row in (table.heading, *table.rows)]
    return [lines[0], "|" + " --- |" * len(table.heading), *lines[1:]]


def _cells(found: Figures) -> list[str]:
    low, high = found["ambiguous_deg"]
    return [band_text(found["band_deg"]), f"{low:g} / {high:g}", f"{100 * found['accepted_beyond']:.2g} %"]
