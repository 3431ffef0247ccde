"""The study's figures as pictures."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from tactful._plotting import KIND_COLOURS, STYLE, matplotlib
from tactful.monitor import Monitor, MonitorConfig, Timeline
from tactful.recordings import Recording
from tactful.studies.kinesthetic._plan import VARIATIONS
from tactful.studies.kinesthetic._published import KINESTHETIC
from tactful.studies.kinesthetic._tables import BLOCKS
from tactful.studies.kinesthetic._watch import Row, outcome_of

Summary = dict[str, Any]
_COLOURS = {"paper": "#b58b3b", "best": "#2e74b5", "best_without_location": "#7fb0dc"}
_GREY = "#8a8f98"
_SHARES = ("accuracy", "specificity", "sensitivity")
_RULE_COLOURS = {"floored": "#b58b3b", "literal": "#8a8f98", "angle": "#2456a6"}


def pictures(summary: Summary, latencies: dict[str, dict[str, list[float]]], folder: Path) -> list[Path]:
    """Draw all figures but the example, and return the files.

    Args:
        summary: what is drawn.
        latencies: by monitor and kind, from `latencies_of` [s].
        folder: where they are written, as SVG.

    Raises:
        TactfulError: if matplotlib is missing.
    """
    mpl = matplotlib()
    drawn: dict[str, tuple[tuple[float, float], Callable[[Any], None]]] = {
        "comparison": ((9.0, 3.6), lambda figure: _comparison(summary, figure)),
        "latencies": ((9.0, 3.2), lambda figure: _latencies(latencies, figure)),
        "tradeoffs": ((9.0, 6.0), lambda figure: _trade_offs(summary, figure)),
        "operators": ((9.0, 3.0), lambda figure: _operators(summary, figure)),
        "sensitivity": ((9.0, 4.6), lambda figure: _sensitivity(summary, figure)),
    }
    files = []
    with mpl.rc_context(STYLE):
        for name, (size, draw) in drawn.items():
            figure = mpl.figure.Figure(figsize=size, layout="constrained")
            draw(figure)
            files.append(folder / f"{name}.svg")
            figure.savefig(files[-1], metadata={"Date": None})
    return files


def example(file: Path, config: MonitorConfig, out: Path) -> Path:
    """Draw an episode as Fig. 1 of the paper does, with the true contacts below, and return the file."""
    recording = Recording.read(file)
    timeline = Monitor(config.robot.load(), config).run(recording, trace=True)
    figure = timeline.plot()
    force, level = figure.axes[1:3]
    for axes in (force, level):
        low, high = axes.get_ylim()
        for label in recording.labels:
            axes.plot(
                [label.start_s, label.end_s],
                [low, low],
                color=KIND_COLOURS[label.kind],
                lw=5,
                solid_capstyle="butt",
                clip_on=False,
                zorder=5,
            )
        axes.set_ylim(low, high)
    level.set_xlabel(f"{level.get_xlabel()}; bars on the axis: the true contacts")
    _cut(timeline, recording, level)
    figure.axes[0].set_title("")
    figure.savefig(out, dpi=150)
    return out


def _cut(timeline: Timeline, recording: Recording, axes: Any) -> None:
    """Show the time of the contacts, and a second before and after."""
    first = min(label.start_s for label in recording.labels)
    last = max(label.end_s for label in recording.labels)
    axes.set_xlim(max(0.0, first - 1.0), min(timeline.end_s, last + 1.0))


def latencies_of(rows: Sequence[Row]) -> dict[str, list[float]]:
    """Return the times from touch to detection of the contacts of each kind that were found [s]."""
    found: dict[str, list[float]] = {"collision": [], "cooperation": []}
    for row in rows:
        for match in outcome_of(row).matches:
            if match.latency_s is not None:
                found[match.label.kind].append(match.latency_s)
    return found


def _comparison(summary: Summary, figure: Any) -> None:
    """Draw shares with intervals, beside the published ones."""
    methods: list[tuple[str, Summary, str]] = [
        *((name, found, _GREY) for name, found in summary["rules"].items()),
        *((name, found, _GREY) for name, found in summary["baselines"].items()),
        *((BLOCKS[key], summary[key], _COLOURS[key]) for key in ("best_without_location", "best")),
    ]
    published = (KINESTHETIC.accuracy, KINESTHETIC.specificity, KINESTHETIC.sensitivity)
    panels = figure.subplots(1, 3, sharey=True)
    y = np.arange(len(methods))[::-1]
    for ax, share, reported in zip(panels, _SHARES, published, strict=True):
        for at, (_, found, colour) in zip(y, methods, strict=True):
            _interval(ax, found[share], float(at), colour)
        assert reported is not None
        ax.axvline(reported, color="#202124", lw=0.9, ls=(0, (4, 3)))
        ax.set_title(f"{share} [%]", fontsize=9)
        ax.set_xlim(left=min(40.0, ax.get_xlim()[0]), right=101)
    panels[0].set_yticks(y, [name for name, _, _ in methods])
    panels[1].set_xlabel("dashed: the paper, on its real robot", fontsize=8)


def _interval(ax: Any, share: Summary, y: float, colour: str, **style: Any) -> None:
    if share["value"] is None:
        return
    low, value, high = (100 * share[key] for key in ("low", "value", "high"))
    ax.plot([low, high], [y, y], color=colour, lw=1.4, alpha=0.8)
    ax.plot([value], [y], "o", color=colour, ms=5, **style)


def _latencies(latencies: dict[str, dict[str, list[float]]], figure: Any) -> None:
    """Draw the share of the found contacts that is detected by a time."""
    for ax, kind in zip(figure.subplots(1, 2, sharey=True), ("collision", "cooperation"), strict=True):
        for name, found in latencies.items():
            ms = 1e3 * np.sort(np.maximum(found[kind], 1e-3))
            share = 100 * np.arange(1, len(ms) + 1) / max(len(ms), 1)
            ax.step(ms, share, where="post", color=_COLOURS[name], label=BLOCKS[name], lw=1.4)
        ax.set(xscale="log", xlim=(1, 2000), ylim=(0, 101), xlabel=f"{kind}: after the touch [ms]")
        ax.xaxis.set_major_formatter("{x:g}")
    figure.axes[0].set_ylabel("detected, of those found [%]")
    figure.axes[0].legend(frameon=False, fontsize=8, loc="lower right")


def _trade_offs(summary: Summary, figure: Any) -> None:
    """Draw what F_th and gamma do, as Sec. V of the paper says in words."""
    (times, counts), (shares, receiver) = figure.subplots(2, 2)
    curve = summary["curves"]["force"]
    threshold = [point["threshold_n"] for point in curve]
    for kind in ("collision", "cooperation"):
        colour = KIND_COLOURS[kind]
        median = [point[kind]["latency_s"]["median"] for point in curve]
        times.plot(threshold, [np.nan if x is None else 1e3 * x for x in median], color=colour, label=kind)
        missed = [100 * point[kind]["missed"] / max(point[kind]["contacts"], 1) for point in curve]
        counts.plot(threshold, missed, color=colour, label=f"{kind} missed [%]")
    alarms = [point["false_alarms"] for point in curve]
    counts.plot(threshold, alarms, color=_GREY, ls="--", label="false alarms (how many)")
    times.set(yscale="log", ylabel="detected after, median [ms]")
    times.yaxis.set_major_formatter("{x:g}")
    counts.set(ylim=(0, 100))
    for ax in (times, counts):
        ax.set(xscale="log", xlabel=r"$F_\mathrm{th}$ [N]")
        ax.xaxis.set_major_formatter("{x:g}")
        ax.axvline(summary["tuned"]["threshold_n"], color="#202124", lw=0.9, ls=(0, (4, 3)))
        ax.legend(frameon=False, fontsize=8)
    for rule, points in summary["curves"]["gamma"].items():
        colour = _RULE_COLOURS[rule]
        specificity = [100 * (point["specificity"]["value"] or 0) for point in points]
        sensitivity = [100 * (point["sensitivity"]["value"] or 0) for point in points]
        if rule != "angle":
            gamma = [point["gamma"] for point in points]
            shares.plot(gamma, specificity, color=colour, label=f"{rule}: specificity")
            shares.plot(gamma, sensitivity, color=colour, ls=":", label=f"{rule}: sensitivity")
        receiver.plot(specificity, sensitivity, color=colour, label=rule)
    shares.axvline(summary["tuned"]["gamma"]["floored"], color="#202124", lw=0.9, ls=(0, (4, 3)))
    shares.set(xscale="log", xlabel="γ", ylabel="[%]", ylim=(0, 101))
    shares.xaxis.set_major_formatter("{x:g}")
    shares.legend(frameon=False, fontsize=7)
    best = summary["best"]
    point = [100 * (best[key]["value"] or 0) for key in ("specificity", "sensitivity")]
    receiver.plot(*([value] for value in point), "*", color=_COLOURS["best"], ms=11, label=BLOCKS["best"])
    assert KINESTHETIC.specificity is not None
    assert KINESTHETIC.sensitivity is not None
    receiver.plot([KINESTHETIC.specificity], [KINESTHETIC.sensitivity], "x", color="#202124", label="paper, real robot")
    receiver.set(xlabel="specificity [%]", ylabel="sensitivity [%]", xlim=(40, 101), ylim=(40, 101))
    receiver.legend(frameon=False, fontsize=8, loc="lower left")


def _operators(summary: Summary, figure: Any) -> None:
    ax = figure.subplots()
    names = list(summary["best"]["per_operator"])
    for i, key in enumerate(BLOCKS):
        for x, name in enumerate(names):
            share = summary[key]["per_operator"].get(name)
            if share is None or share["value"] is None:
                continue
            at = x + 0.2 * (i - 1)
            ax.plot([at, at], [100 * share["low"], 100 * share["high"]], color=_COLOURS[key], lw=1.4)
            ax.plot([at], [100 * share["value"]], "o", color=_COLOURS[key], ms=5, label=BLOCKS[key] if x == 0 else None)
    ax.set_xticks(range(len(names)), names)
    ax.set(ylabel="sensitivity [%]", ylim=(0, 103))
    ax.legend(frameon=False, fontsize=8, loc="lower right")


def _sensitivity(summary: Summary, figure: Any) -> None:
    panels = figure.subplots(1, 3, sharey=True)
    names = ["reference", *VARIATIONS]
    y = np.arange(len(names))[::-1]
    for ax, share in zip(panels, _SHARES, strict=True):
        for key, shift in (("paper", -0.13), ("best", 0.13)):
            for at, name in zip(y, names, strict=True):
                _interval(ax, summary["sensitivity"][key][name][share], at + shift, _COLOURS[key])
        ax.set_title(f"{share} [%]", fontsize=9)
        ax.set_xlim(right=101)
    panels[0].set_yticks(y, ["as it is", *VARIATIONS])
    for key in ("best", "paper"):
        panels[0].plot([], [], "o-", color=_COLOURS[key], ms=5, label=BLOCKS[key])
    panels[0].legend(frameon=False, fontsize=7, loc="lower left")
