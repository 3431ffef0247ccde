"""The study's figures as pictures."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from tactful._plotting import STYLE, matplotlib
from tactful.studies.isolation._summary import METHODS, Figures

_COLOURS = ("#8a8f98", "#b58b3b", "#2e74b5")


def pictures(summary: Figures, folder: Path) -> list[Path]:
    """Draw the links, the calibration and the settling, and return the files.

    Raises:
        TactfulError: if matplotlib is missing.
    """
    mpl = matplotlib()
    files = []
    with mpl.rc_context(STYLE):
        for name, draw, size in (
            ("links", _links, (9, 3.6)),
            ("calibration", _calibration, (4, 3.6)),
            ("motion", _motion, (5, 3.6)),
        ):
            figure = mpl.figure.Figure(figsize=size, layout="constrained")
            draw(summary, figure)
            figure.suptitle(f"{summary['robot']}, simulated contacts", fontsize=9, color="#5f6368")
            files.append(folder / f"{name}.svg")
            figure.savefig(files[-1], metadata={"Date": None})
    return files


def _bar(share: Any) -> tuple[float, list[list[float]]]:
    value = share["value"]
    return value, [[value - share["low"]], [share["high"] - value]]


def _links(summary: Figures, figure: Any) -> None:
    rates, confusion = figure.subplots(1, 2, width_ratios=(1.2, 1))
    noises = [row["noise_nm"] for row in summary["links"]]
    for name, colour in zip(METHODS, _COLOURS, strict=True):
        for key, style in (("exact", "o-"), ("within_one", "o:")):
            values = [row[name][key]["value"] for row in summary["links"]]
            label = name if key == "exact" else None
            rates.plot(noises, values, style, color=colour, ms=4, label=label)
    rates.set(xscale="log", xlabel="noise of tau_ext [Nm]", ylabel="link exact (dotted: within one)", ylim=(0, 1.02))
    rates.set_xticks(noises, [f"{noise:g}" for noise in noises])
    rates.minorticks_off()
    rates.legend(frameon=False, fontsize=8)
    counts = np.array(summary["confusion"], dtype=float)
    share = counts / np.maximum(counts.sum(axis=1, keepdims=True), 1)
    confusion.imshow(share, cmap="Blues", vmin=0, vmax=1)
    for i, j in np.argwhere(share >= 0.005):
        colour = "white" if share[i, j] > 0.5 else "black"
        confusion.text(j, i, f"{100 * share[i, j]:.0f}", ha="center", va="center", fontsize=7, color=colour)
    names = [str(i + 1) for i in range(len(share))]
    confusion.set_xticks(range(len(share)), names)
    confusion.set_yticks(range(len(share)), names)
    confusion.grid(visible=False)
    confusion.set(xlabel="link found", ylabel="link touched [%]")


def _calibration(summary: Figures, figure: Any) -> None:
    axes = figure.subplots()
    axes.plot([0, 1], [0, 1], color="#8a8f98", lw=0.8)
    for row in summary["calibration"]:
        value, error = _bar(row["right"])
        axes.errorbar([row["mean"]], [value], yerr=error, fmt="o", ms=4, color=_COLOURS[2], capsize=2)
    axes.set(xlabel="probability stated", ylabel="link right", xlim=(0.2, 1.02), ylim=(0.2, 1.02))


def _motion(summary: Figures, figure: Any) -> None:
    axes = figure.subplots()
    for row, colour in zip(summary["motion"], (_COLOURS[2], _COLOURS[1]), strict=True):
        after = [1e3 * point["after_s"] for point in row["over_time"]]
        shares = [point["right"] for point in row["over_time"]]
        axes.plot(after, [share["value"] for share in shares], color=colour, label=f"{row['bandwidth_hz']:g} Hz")
        axes.fill_between(
            after,
            [share["low"] for share in shares],
            [share["high"] for share in shares],
            color=colour,
            alpha=0.15,
            lw=0,
        )
    axes.set(xlabel="after the onset [ms]", ylabel="link right", ylim=(0, 1.02))
    axes.legend(title="observer", frameon=False)
