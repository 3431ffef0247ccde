"""The study's pictures."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from tactful.errors import TactfulError
from tactful.simulation._peg import PEG_RADIUS_M
from tactful.simulation._scene import BOX_HALF_M, BOX_HEIGHT_M
from tactful.studies.teaching._summary import Figures
from tactful.studies.teaching._trials import TRAJECTORIES, Trial

_STYLE: Any = {
    "font.size": 9,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.color": "#e6e8eb",
    "axes.axisbelow": True,
    "svg.fonttype": "none",
    "svg.hashsalt": "tactful",
}
_GREY, _SAND, _BLUE = "#8a8f98", "#b58b3b", "#2e74b5"


def pictures(summary: Figures, trials: dict[str, list[Trial]], folder: Path) -> None:
    """Draw the rates, and one lesson of every trajectory.

    Raises:
        TactfulError: if matplotlib is missing.
    """
    try:
        import matplotlib as mpl
        from matplotlib.figure import Figure
    except ImportError:
        raise TactfulError('the figures need matplotlib: pip install "tactful[plot]"') from None
    with mpl.rc_context(_STYLE):
        figure = Figure(figsize=(3.6 * len(summary["presets"]), 3.5), layout="constrained")
        _rates(summary, figure)
        figure.savefig(folder / "rates.svg", metadata={"Date": None})
        figure = Figure(figsize=(9, 3.6), layout="constrained")
        _lessons([row for rows in trials.values() for row in rows], figure)
        figure.savefig(folder / "lessons.svg", metadata={"Date": None})


def _rates(summary: Figures, figure: Any) -> None:
    panels = figure.subplots(1, len(summary["presets"]), sharey=True, squeeze=False)[0]
    for axes, (sensors, figures) in zip(panels, summary["presets"].items(), strict=True):
        groups = {"all": figures["all"], **figures["by_trajectory"]}
        for offset, key, colour in ((-0.18, "before", _GREY), (0.18, "after", _BLUE)):
            for x, rates in enumerate(groups.values()):
                share = rates[key]
                if share["value"] is None:
                    continue
                error = [[share["value"] - share["low"]], [share["high"] - share["value"]]]
                label = f"{key} one correction" if x == 0 else None
                axes.bar(x + offset, share["value"], 0.34, color=colour, label=label)
                axes.errorbar(x + offset, share["value"], yerr=error, color="#202124", lw=0.8, capsize=2)
        axes.set_xticks(range(len(groups)), list(groups))
        axes.set(title=f"sensors: {sensors}", ylim=(0, 1.02))
    panels[0].set_ylabel("peg inserted without help (simulation)")
    figure.legend(*panels[0].get_legend_handles_labels(), frameon=False, loc="outside lower center", ncols=2)


def _lessons(rows: Sequence[Trial], figure: Any) -> None:
    """Draw the first lesson of every trajectory in which one was needed, and worked."""
    taught = {row.trajectory: row for row in reversed(rows) if row.cooperation and row.after}
    shown = [taught[name] for name in TRAJECTORIES if name in taught]
    if not shown:
        return
    for axes, row in zip(figure.subplots(1, len(shown), sharey=True, squeeze=False)[0], shown, strict=True):
        axes.set(title=row.trajectory, xlabel="in the plane of the motion [m]", aspect="equal")
        _lesson(row.ways, axes)
    figure.axes[0].set_ylabel("height [m]")
    figure.legend(*figure.axes[-1].get_legend_handles_labels(), frameon=False, loc="outside lower center", ncols=3)


def _lesson(ways: dict[str, Any], axes: Any) -> None:
    hole = np.array(ways["hole"])
    first = np.array(ways["first"])
    away = first[0, :2] - hole[:2]
    away /= np.linalg.norm(away)
    radius = PEG_RADIUS_M
    for side in (-1, 1):
        near, far = sorted((side * radius, side * BOX_HALF_M))
        axes.fill_between([near, far], 0, BOX_HEIGHT_M, color="#dfe3e8", lw=0)
    axes.fill_between([-radius, radius], 0, BOX_HEIGHT_M - 0.09, color="#dfe3e8", lw=0)
    for key, colour, style, label in (
        ("plan", _GREY, ":", "reference"),
        ("first", _SAND, "-", "first execution, with the hand"),
        ("next", _BLUE, "-", "next execution, alone"),
    ):
        way = np.array(ways[key])
        axes.plot((way[:, :2] - hole[:2]) @ away, way[:, 2], style, color=colour, lw=1.4, label=label)
