"""The report of the study."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from tactful.studies._report import Picture, Section, report, targets_table
from tactful.studies.aim_aware._panda_tables import (
    bench_bands_table,
    bench_intro,
    bench_variants_table,
    settings_table,
)
from tactful.studies.aim_aware._tables import bands_table, intro, robustness_table

_CAPTIONS = {
    "fig6": "As Fig. 6 of the paper: velocity error of the joints (line) and its envelope with the margin, where it is "
    "judged (band); red where it does not hold zero. Above as planned, below on a surface inclined by 5 deg. Dotted: "
    "detected impacts.",
    "fig7": "As Fig. 7 of the paper: share of impacts told as expected over the inclination of the surface. Shaded: "
    "always expected. Dashed: about the band that the paper reports.",
    "fig6b": "As Fig. 6 (b) of the paper: the same on the bench, with the recorded reference and Tab. 2 strict; above "
    "as planned, below on a platform inclined by 4 deg.",
    "fig8": "As Fig. 8 of the paper: share of impacts told as expected over the inclination of the platform, four at "
    "each. Shaded: always expected. Dashed: about the band that the paper reports.",
}


def page(summary: dict[str, Any], folder: Path) -> str:
    """Return the report as HTML: what there is of the planar sweep, and of the bench."""
    shown = {name: Picture(folder / f"{name}.svg", caption) for name, caption in _CAPTIONS.items()}
    sections = _planar(summary, shown) if "table1" in summary else []
    if "panda" in summary:
        sections += _bench(summary["panda"], shown)
    return report(
        "Expected or unexpected impact: the experiments of the aim-aware paper, simulated",
        sections,
        footer="All figures are simulated. Written by tactful study aim-aware.",
    )


def _planar(summary: dict[str, Any], shown: dict[str, Picture]) -> list[Section]:
    return [
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
    ]


def _bench(panda: dict[str, Any], shown: dict[str, Picture]) -> list[Section]:
    return [
        Section(
            "The experiment: a Panda strikes an inclined platform",
            ["The paper's Sec. IV-B, with a simulated arm in place of the real one.", *bench_intro(panda)],
        ),
        Section(
            "Which inclinations are accepted in the experiment",
            [
                shown["fig8"],
                "Of its experiment the paper gives the bands of the two sets; the rest of its Fig. 8 is drawn only: "
                "asymmetric, with ambiguous inclinations beside the band.",
                bench_bands_table(panda),
                settings_table(panda),
            ],
        ),
        Section("How it is told in the experiment", [shown["fig6b"]]),
        Section("Where something differs from the assumed bench", [bench_variants_table(panda)]),
        Section("The experiment's targets", [targets_table(panda["targets"])]),
    ]
