"""The study's figures in tables."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from tactful.studies._report import Table, targets_table
from tactful.studies.aim_aware._panda_tables import (
    bench_bands_table,
    bench_intro,
    bench_variants_table,
    settings_table,
)
from tactful.studies.aim_aware._targets import cells

Figures = dict[str, Any]

PAPER: Mapping[str, tuple[str, str, str]] = {
    name: (band, "about 2", "0 %") for name, band in (("strict", "0"), ("medium", "[-2, 2]"), ("wide", "[-4, 4]"))
}
"""What the paper says of its sets: always accepted [deg], ambiguous on each side [deg], accepted beyond."""
_TITLES = {
    "table1": "Tab. 1 verbatim",
    "tuned": "tuned",
    "tilt": "tuned, with the tilt",
    "early": "tuned, with the tilt, from the first impact",
    "raw": "raw error, tuned",
}
_MORE = {"tuned": "", "tilt": ", with the tilt", "early": ", with the tilt, from the first impact"}


def bands_table(summary: Figures) -> Table:
    """Return the bands of every set, on the grid and held out, beside what the paper says."""
    heading = ("set", "paper: band [deg]", "ambiguous", "beyond", "grid: band [deg]", "ambiguous", "beyond")
    rows = []
    for group, title in _TITLES.items():
        for name, said in PAPER.items():
            if name in summary[group]:
                found = summary[group][name]
                rows.append((f"{title}, {name}", *said, *cells(found), *cells(found["held_out"])))
    return Table((*heading, "held out: band", "ambiguous", "beyond"), rows)


def robustness_table(summary: Figures) -> Table:
    """Return what is kept of the bands where something differs from the assumed arm."""
    names = [(group, name) for group in _MORE for name in PAPER if group == "tuned" or name != "strict"]
    heading = [f"{name}{_MORE[group]}" for group, name in names]
    rows = []
    for row in summary["robustness"]:
        found = [row[group][name] for group, name in names]
        rows.append((row["variant"], *(", ".join(cells(x)) if "rate" in x else "not to be tuned" for x in found)))
    return Table(("variant: band, ambiguous, beyond", *heading), rows)


def tables(summary: Figures) -> str:
    """Return the tables as Markdown."""
    lines = ["# Expected or unexpected impact, simulated", ""]
    if "table1" in summary:
        lines += [*intro(summary), "", *_markdown(bands_table(summary)), ""]
        lines += ["## Tuned anew on what differs; held-out impacts", "", *_markdown(robustness_table(summary)), ""]
        lines += ["## Targets", "", *_markdown(targets_table(summary["targets"])), ""]
    if panda := summary.get("panda"):
        lines += ["## The experiment: a Panda on the bench", "", *bench_intro(panda), ""]
        for table in (bench_bands_table(panda), bench_variants_table(panda), settings_table(panda)):
            lines += [*_markdown(table), ""]
        lines += ["## The experiment's targets", "", *_markdown(targets_table(panda["targets"])), ""]
    return "\n".join(lines)


def intro(summary: Figures) -> list[str]:
    """Return what the figures are of."""
    late, wait = summary["verdict_after_first_impact_s"], summary["verdict_after_last_impact_s"]
    early = summary["early_inclination"]
    early_s = early["verdict_after_first_impact_s"]
    return [
        f"{summary['impacts']} impacts of the grid {summary['grid']!r}: {summary['cpu_s']:.0f} s of CPU to simulate "
        "and judge them. Held out: approaches and places that nothing was tuned on, inclinations every 0.25 deg.",
        f"Inclination from the tip in contact, held out, within ±8 deg: mean error {summary['inclination_mae_deg']:.2g}"
        f" deg, worst {summary['inclination_worst_deg']:.2g} deg. The verdict comes {1e3 * wait['largest']:.0f} ms "
        f"after the last impact; after the first one, median {1e3 * late['median']:.0f} ms, 95 % within "
        f"{1e3 * late['p95']:.0f} ms. The sets that judge from the first impact: {1e3 * early_s['largest']:.0f} ms "
        f"after it at most, and then the inclination has a mean error of {early['inclination_mae_deg']:.2g} deg, worst "
        f"{early['inclination_worst_deg']:.2g} deg.",
    ]


def _markdown(table: Table) -> list[str]:
    lines = ["| " + " | ".join(row) + " |" for row in (table.heading, *table.rows)]
    return [lines[0], "|" + " --- |" * len(table.heading), *lines[1:]]
