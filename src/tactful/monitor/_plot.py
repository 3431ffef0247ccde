"""The picture of a timeline."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from tactful._plotting import KIND_COLOURS, STYLE, matplotlib
from tactful.detection import AXES, thresholds
from tactful.errors import TactfulError

if TYPE_CHECKING:
    from tactful.monitor._timeline import Timeline

_AXIS_COLOURS = ("#c0392b", "#2c7a4b", "#2456a6")
_COLUMNS = 4000
_DASHES = (0, (4, 3))


def draw(timeline: Timeline, path: str | Path | None) -> Any:
    """Draw a timeline, see `Timeline.plot`."""
    if timeline.trace is None:
        raise TactfulError("the timeline has no trace to plot: run the monitor with trace=True")
    mpl = matplotlib()
    trace = timeline.trace[np.isfinite(timeline.trace["t"])]
    if not len(trace):
        raise TactfulError(f"{timeline.source}: no sample was good enough to plot")
    with mpl.rc_context(STYLE):
        figure = mpl.figure.Figure(figsize=(10, 5.6), layout="constrained")
        strip, force, level = figure.subplots(3, 1, sharex=True, height_ratios=(0.8, 3, 2.2))
        start = float(trace["t"][0])
        t = trace["t"] - start
        for i, (axis, colour) in enumerate(zip(AXES, _AXIS_COLOURS, strict=True)):
            force.plot(*_thinned(t, trace["wrench"][:, i]), color=colour, lw=0.9, label=f"$F_{axis}$")
        _levels(timeline, level, t, trace["level"])
        _bands(timeline, (strip, force, level), start, float(t[-1]))
        force.set_ylabel("external force [N]")
        level.set_xlabel("time [s]" if start == 0 else f"time since {start:.6g} s [s]")
        level.set_xlim(0, float(t[-1]) or 1.0)
        level.set_ylim(bottom=0.1 if timeline.config.mode == "fast" else 0)
        for axes in (force, level) if timeline.config.mode == "paper" else (force,):
            axes.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), frameon=False, handlelength=1.2)
        strip.set_axis_off()
        strip.set_ylim(0, 1)
        name = Path(timeline.source).name
        count = len(timeline.events)
        strip.set_title(
            f"{name}{f' · {timeline.robot}' if timeline.robot else ''} · {count} contact{'s' * (count != 1)}",
            loc="left",
            fontsize=10,
            color="#202124",
        )
        if path is not None:
            _save(figure, Path(path))
    return figure


def _levels(timeline: Timeline, axes: Any, t: NDArray[np.float64], level: NDArray[np.float64]) -> None:
    """Draw what the detector looked at, against its threshold."""
    if timeline.config.mode == "fast":
        axes.plot(*_thinned(t, level[:, 0]), color="#5f6368", lw=0.9)
        axes.set_yscale("log")
        axes.yaxis.set_major_formatter("{x:g}")
        axes.set_ylabel("statistic / threshold")
        _limit(axes, 1.0, "")
        return
    limits = thresholds(timeline.config.frequency)
    alike = len(set(limits)) == 1
    for i, (axis, colour, limit) in enumerate(zip(AXES, _AXIS_COLOURS, limits, strict=True)):
        name = rf"$\hat F_\omega^{axis}$"
        axes.plot(*_thinned(t, level[:, i]), color=colour, lw=0.9, label=name if alike else f"{name}, {limit:.2g} N")
        if not alike:
            axes.axhline(limit, color=colour, lw=0.9, ls=_DASHES)
    if alike:
        _limit(axes, limits[0], " N")
    low, high = timeline.config.frequency.band_hz
    axes.set_ylabel(f"level, {low:.3g}–{high:.3g} Hz [N]")


def _limit(axes: Any, limit: float, unit: str) -> None:
    axes.axhline(limit, color="#202124", lw=0.9, ls=_DASHES)
    axes.text(1.0, limit, f" {limit:g}{unit}", transform=axes.get_yaxis_transform(), va="center", color="#202124")


def _bands(timeline: Timeline, axes: tuple[Any, Any, Any], start: float, duration: float) -> None:
    """Shade every contact, mark its onset and its detection, and name it above."""
    strip, *panels = axes
    row_ends = [-np.inf, -np.inf]  # where the last name of each row begins
    for event in timeline.events:
        colour = KIND_COLOURS[event.kind]
        begin = event.onset_s - start
        end = duration if event.end_s is None else max(event.end_s, event.detected_s) - start
        for panel in panels:
            panel.axvspan(begin, end, color=colour, alpha=0.13, lw=0)
            panel.axvline(event.detected_s - start, color=colour, lw=1.0)
        strip.axvspan(begin, end, ymin=0.0, ymax=0.12, color=colour, lw=0)
        row = next((i for i, last in enumerate(row_ends) if begin - last >= 0.11 * duration), None)
        if row is None:
            continue
        row_ends[row] = begin
        size = f"{event.peak_force_n:.0f} N" if event.peak_force_n >= 10 else f"{event.peak_force_n:.1f} N"
        strip.annotate(
            f"{event.kind.replace('_', ' ')}\n{size}",
            (begin, 0.2 + 0.55 * row),
            color=colour,
            fontsize=8,
            va="bottom",
            ha="right" if begin > 0.9 * duration else "left",
            annotation_clip=False,
        )


def _thinned(t: NDArray[np.float64], x: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return what of a long curve can be seen: the least and the largest value of each column of the picture."""
    width = len(t) // _COLUMNS
    if width < 4:
        return t, x
    count = len(t) // width * width
    blocks = x[:count].reshape(-1, width)
    low_high = np.stack([blocks.min(axis=1), blocks.max(axis=1)], axis=1).ravel()
    return np.repeat(t[:count:width], 2), low_high


def _save(figure: Any, file: Path) -> None:
    try:
        figure.savefig(file, dpi=150)
    except OSError as error:
        raise TactfulError(f"{file}: cannot be written: {error.strerror or error}") from None
    except ValueError as error:
        raise TactfulError(f"{file}: {str(error).splitlines()[0]}") from None
