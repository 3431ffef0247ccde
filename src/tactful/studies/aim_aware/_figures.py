"""Fig. 6 and Fig. 7 of the paper, from the study's own runs."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from tactful._plotting import STYLE, matplotlib
from tactful.classification import AimAware, AimAwareConfig
from tactful.simulation.planar import PlanarConfig, simulate_impact
from tactful.studies.aim_aware._summary import R_B_TABLE1, TOLERANCE_DEG, Figures

_BLUE, _LIGHT, _RED, _GREY = "#2e74b5", "#cfe0f1", "#d9534f", "#8a8f98"
_JOINTS = ("shoulder", "elbow", "wrist")


def pictures(summary: Figures, planar: PlanarConfig, folder: Path) -> list[Path]:
    """Draw the rates over the inclination (Fig. 7) and the envelope of two impacts (Fig. 6), and return the files.

    Raises:
        TactfulError: if matplotlib is missing.
    """
    mpl = matplotlib()
    files = []
    with mpl.rc_context(STYLE):
        for name, size in (("fig7", (9.0, 7.2)), ("fig6", (9.0, 4.6))):
            figure = mpl.figure.Figure(figsize=size, layout="constrained")
            if name == "fig7":
                _rates(figure, summary)
            else:
                _envelopes(figure, planar)
            files.append(folder / f"{name}.svg")
            figure.savefig(files[-1], metadata={"Date": None})
    return files


def _rates(figure: Any, summary: Figures) -> None:
    groups = (("table1", "Tab. 1"), ("tuned", "tuned"), ("tilt", "with tilt"))
    rows = figure.subplots(3, 3, sharex=True, sharey=True)
    for axes, (group, title) in zip(rows, groups, strict=True):
        for ax, (name, tolerance) in zip(axes, TOLERANCE_DEG.items(), strict=True):
            found = summary[group][name]
            beta = np.array(found["beta_deg"])
            if found["band_deg"] is not None:
                low, high = found["band_deg"]
                ax.axvspan(low - 0.5, high + 0.5, color=_LIGHT, lw=0)
            ax.bar(beta, 100 * np.array(found["rate"]), width=0.8 * float(np.diff(beta).min()), color=_BLUE)
            for edge in (-tolerance, tolerance):
                ax.axvline(edge, color=_GREY, lw=0.8, ls="--")
            ax.set_title(f"{title}, {name}: paper {_said(tolerance)}", fontsize=9)
    for ax in rows[-1]:
        ax.set_xlabel("inclination β [deg]")
    for ax in rows[:, 0]:
        ax.set_ylabel("expected [%]")


def _said(tolerance: float) -> str:
    return "0" if tolerance == 0 else f"±{tolerance:g} deg"


def _envelopes(figure: Any, planar: PlanarConfig) -> None:
    config = AimAwareConfig.table1("medium", impact=R_B_TABLE1)
    rows = figure.subplots(2, 3, sharex="row")
    for axes, beta in zip(rows, (0.0, 5.0), strict=True):
        run = simulate_impact(90.0, 0.3, beta, planar)
        aim = AimAware(run.plan, config)
        trace = aim.trace(run.t, run.q, run.dq, run.r)
        result = aim.result
        first, last = result.impact_s[0], result.impact_s[max(result.judged - 1, 0)]
        shown = (run.t >= first - 0.02) & (run.t <= last + config.xi_s + 0.02)
        judged = (run.t >= last + config.m_c * planar.period_s) & (run.t <= last + config.xi_s)
        margin = float(config.margins(3)[0])
        for i, ax in enumerate(axes):
            low, high = trace.lower[:, i] - margin, trace.upper[:, i] + margin
            ax.plot(run.t[shown], trace.e_vel[shown, i], color=_BLUE, lw=1)
            ax.fill_between(run.t[judged], low[judged], high[judged], color=_LIGHT, lw=0)
            ax.fill_between(run.t[judged], 0, np.maximum(low[judged], 0), color=_RED, alpha=0.6, lw=0)
            ax.fill_between(run.t[judged], np.minimum(high[judged], 0), 0, color=_RED, alpha=0.6, lw=0)
            for time in result.impact_s:
                ax.axvline(time, color=_GREY, lw=0.8, ls=":")
            ax.set_ylim(-1.3, 1.3)
            ax.set_title(f"{_JOINTS[i]}, β = {beta:g} deg: {result.verdict}", fontsize=9)
    for ax in rows[-1]:
        ax.set_xlabel("time [s]")
    for ax in rows[:, 0]:
        ax.set_ylabel("velocity error [rad/s]")
