"""The report of the study."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from tactful.studies._report import Picture, Section, report, targets_table
from tactful.studies.aim_aware._tables import bands_table, intro, robustness_table

_CAPTIONS = {
    "fig6": "As Fig. 6 of the paper: velocity error of the joints (line) and its envelope with the margin, where it is "
    "judged (band); red where it does not hold zero. Above as planned, below on a surface inclined by 5 deg. Dotted: "
    "detected impacts.",
    "fig7": "As Fig. 7 of the paper: share of impacts told as expected over the inclination of the surface. Shaded: "
    "always expected. Dashed: the band that the paper reports.",
}


def page(summary: dict[str, Any], figures: Sequence[Path]) -> str:
    """Return the report as HTML."""
    shown = {file.stem: Picture(file, _CAPTIONS[file.stem]) for file in figures}
    return report(
        "Expected or unexpected impact: the simulated experiment of the aim-aware paper",
        [
            Section(
                "What this is",
                [
                    "B. Proper, A. Kurdas, S. Abdolshah, S. Haddadin, A. Saccon, Aim-aware collision monitoring, 2023 "
                    "(hal-03974694), Sec. IV-A, repeated in simulation. The paper gives neither robot nor controller "
                    "nor r_b: the arm here is assumed. This shows that the figures can be reached, no more.",
                    *intro(summary),
                ],
            ),
            Section(
                "Which inclinations are accepted",
                [
                    shown["fig7"],
                    "Band: always accepted. Ambiguous: how far below and above it they are accepted at times. Beyond: "
                    "share accepted further out. The paper gives the bands of its sets, ambiguous sides of about 2 deg "
                    "and none beyond. 'With the tilt' judges the rotation of the tool, too, which the paper does not.",
                    bands_table(summary),
                ],
            ),
            Section("How it is told", [shown["fig6"]]),
            Section(
                "Where something differs from the assumed arm",
                [
                    "Each row is tuned anew on impacts of its own, and measured on others.",
                    robustness_table(summary),
                ],
            ),
            Section("Targets", [targets_table(summary["targets"])]),
        ],
        footer="All figures are simulated. Written by tactful study aim-aware.",
    )
