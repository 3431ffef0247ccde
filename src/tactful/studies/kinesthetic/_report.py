"""The report: one HTML file that needs nothing else."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from tactful.studies import _report
from tactful.studies.kinesthetic._tables import Table, origin, tables

Summary = dict[str, Any]

CAPTIONS = {
    "example": "An episode as in Fig. 1 of the paper: the external force at the tip, its level in the band against the "
    "threshold, and what the paper's monitor told (shaded, vertical lines at the detections).",
    "comparison": "Rules of the paper, its baselines and the learned classifier on the same contacts; the dashed line "
    "is what the paper reports of its real robot.",
    "latencies": "How soon after the first touch contacts are detected.",
    "tradeoffs": "The two thresholds of the paper (its Sec. V): F_th trades speed against misses and false alarms, γ "
    "specificity against sensitivity. Dashed: what the protocol chose. F_th: first contacts of the episodes.",
    "operators": "Cooperation told as such, by operator. The learned classifier was trained on other operators.",
    "sensitivity": "The same episodes with one thing changed, nothing tuned or trained anew.",
}
_PLACES = {
    "targets": (),
    "blocks": ("comparison", "latencies"),
    "table1": ("example",),
    "rules": ("tradeoffs",),
    "operators": ("operators",),
    "sensitivity": ("sensitivity",),
}
"""Which figures follow which table."""


def report(summary: Summary, pictures: Mapping[str, Path]) -> str:
    """Return the report.

    Args:
        summary: the figures.
        pictures: SVG and PNG files by their names; they go into the report.
    """
    text = (
        "The experiment of Salt Ducaju et al. 2022 (doi:10.1109/RO-MAN53752.2022.9900800) in simulation, and what does "
        f"better. {origin(summary)}"
    )
    sections = [_report.Section("What this is", (text,))]
    for table in tables(summary):
        shown = [name for name in _PLACES.get(table.key, ()) if name in pictures]
        figures = [_report.Picture(pictures[name], CAPTIONS[name]) for name in shown]
        sections.append(_report.Section(table.title, (_plain(table), *([table.note] if table.note else []), *figures)))
    return _report.report("Collision or cooperation?", sections, footer=f"tactful {summary['version']}")


def _plain(table: Table) -> _report.Table:
    rows = [["missed" if cell == "no" else cell for cell in row] for row in table.rows]
    return _report.Table(table.headings, rows)
