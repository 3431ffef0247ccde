"""Fig. 8 and Fig. 6 (b) of the paper, from the runs on the bench."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from tactful._plotting import STYLE, matplotlib
from tactful.classification import AimAwareConfig
from tactful.simulation.impact_bench import BenchConfig
from tactful.studies.aim_aware._figures import draw_envelope, draw_rates
from tactful.studies.aim_aware._panda_runs import ALPHA_DEG, DATA, MODEL, BenchRuns
from tactful.studies.aim_aware._panda_summary import PUBLISHED, Figures

_SHOWN_DEG = (0.0, 4.0)
_JOINTS = (1, 3, 5)
"""The joints that move in the plane of the approach."""


def bench_pictures(figures: Figures, report: BenchRuns, bench: BenchConfig, folder: Path) -> None:
    """Draw the rates over the inclination (Fig. 8) and the envelope of two impacts (Fig. 6 b).

    Raises:
        TactfulError: if matplotlib is missing.
    """
    mpl = matplotlib()
    with mpl.rc_context(STYLE):
        for name, size in (("fig8", (9.0, 8.0)), ("fig6b", (9.0, 4.6))):
            figure = mpl.figure.Figure(figsize=size, layout="constrained")
            if name == "fig8":
                _rates(figure, figures)
            else:
                _envelopes(figure, report, bench)
            figure.savefig(folder / f"{name}.svg", metadata={"Date": None})


def _rates(figure: Any, figures: Figures) -> None:
    rows = [(r, g) for g in ("table2", "tuned") for r in (DATA, MODEL)]
    said = {DATA: "recorded", MODEL: "impact map", "table2": "Tab. 2", "tuned": "tuned"}
    axes = figure.subplots(len(rows), 2, sharex=True, sharey=True)
    for line, (reference, group) in zip(axes, rows, strict=True):
        for ax, (name, published) in zip(line, PUBLISHED.items(), strict=True):
            found = figures[reference][group].get(name)
            title = f"{said[group]}, {name}, {said[reference]}; paper: {_degrees(published)}"
            ax.set_title(title if found else f"{title}; not to be tuned", fontsize=9)
            if found:
                draw_rates(ax, found, published)
    for ax in axes[-1]:
        ax.set_xlabel("inclination β [deg]")
    for ax in axes[:, 0]:
        ax.set_ylabel("expected [%]")


def _degrees(band: tuple[float, float]) -> str:
    low, high = band
    return f"{low:g} deg" if low == high else f"{low:g} to {high:g} deg"


def _envelopes(figure: Any, report: BenchRuns, bench: BenchConfig) -> None:
    config = AimAwareConfig.table2("strict", impact=bench.impact)
    rows = figure.subplots(len(_SHOWN_DEG), len(_JOINTS), sharex="row")
    for axes, beta in zip(rows, _SHOWN_DEG, strict=True):
        case = int(np.argmin(np.abs(report.cases - [ALPHA_DEG[1], beta]).sum(axis=1)))
        titles = tuple(f"joint {joint + 1}, β = {report.cases[case, 1]:g} deg" for joint in _JOINTS)
        draw_envelope(axes, report.runs[DATA][case], config, _JOINTS, titles, bench.cell.period_s)
    for ax in rows[-1]:
        ax.set_xlabel("time [s]")
    for ax in rows[:, 0]:
        ax.set_ylabel("velocity error [rad/s]")
