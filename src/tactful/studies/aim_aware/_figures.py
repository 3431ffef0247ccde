"""Fig. 6 and Fig. 7 of the paper, from the study's own runs."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from tactful._plotting import STYLE, matplotlib
from tactful.classification import AimAware, AimAwareConfig
from tactful.simulation.planar import PlanarConfig, simulate_impact
from tactful.studies.aim_aware._summary import R_B_TABLE1, TOLERANCE_DEG, Figures
from tactful.studies.aim_aware._targets import tolerance_text

_BLUE, _LIGHT, _RED, _GREY, _DARK = "#2e74b5", "#cfe0f1", "#d9534f", "#8a8f98", "#22262b"
_JOINTS = ("shoulder", "elbow", "wrist")


def pictures(summary: Figures, planar: PlanarConfig, folder: Path) -> None:
    """Draw the rates over the inclination (Fig. 7) and the envelope of two impacts (Fig. 6).

    Raises:
        TactfulError: if matplotlib is missing.
    """
    mpl = matplotlib()
    with mpl.rc_context(STYLE):
        for name, size in (("fig7", (9.0, 7.2)), ("fig6", (9.0, 4.6))):
            figure = mpl.figure.Figure(figsize=size, layout="constrained")
            if name == "fig7":
                _rates(figure, summary)
            else:
                _envelopes(figure, planar)
            figure.savefig(folder / f"{name}.svg", metadata={"Date": None})


def _rates(figure: Any, summary: Figures) -> None:
    groups = (("table1", "Tab. 1"), ("tuned", "tuned"), ("tilt", "with tilt"))
    rows = figure.subplots(3, 3, sharex=True, sharey=True)
    for axes, (group, title) in zip(rows, groups, strict=True):
        for ax, (name, tolerance) in zip(axes, TOLERANCE_DEG.items(), strict=True):
            draw_rates(ax, summary[group][name], (-tolerance, tolerance))
            ax.set_title(f"{title}, {name}; paper: {tolerance_text(tolerance)}", fontsize=9)
    for ax in rows[-1]:
        ax.set_xlabel("inclination β [deg]")
    for ax in rows[:, 0]:
        ax.set_ylabel("expected [%]")


def draw_rates(ax: Any, found: Figures, published: tuple[float, float]) -> None:
    """Draw the share that is accepted at each inclination; shaded what always is, dashed what is in the paper."""
    beta = np.array(found["beta_deg"])
    step = float(np.diff(beta).min())
    if found["band_deg"] is not None:
        low, high = found["band_deg"]
        ax.axvspan(low - 0.5 * step, high + 0.5 * step, color=_LIGHT, lw=0)
    ax.bar(beta, 100 * np.array(found["rate"]), width=0.8 * step, color=_BLUE)
    for edge in (published[0] - 0.5 * step, published[1] + 0.5 * step):
        ax.axvline(edge, color=_DARK, lw=0.9, ls="--")


def _envelopes(figure: Any, planar: PlanarConfig) -> None:
    config = AimAwareConfig.table1("medium", impact=R_B_TABLE1)
    rows = figure.subplots(2, 3, sharex="row")
    for axes, beta in zip(rows, (0.0, 5.0), strict=True):
        run = simulate_impact(90.0, 0.3, beta, planar)
        titles = tuple(f"{joint}, β = {beta:g} deg" for joint in _JOINTS)
        draw_envelope(axes, run, config, range(3), titles, planar.period_s)
    for ax in rows[-1]:
        ax.set_xlabel("time [s]")
    for ax in rows[:, 0]:
        ax.set_ylabel("velocity error [rad/s]")


def draw_envelope(
    axes: Any, run: Any, config: AimAwareConfig, joints: Sequence[int], titles: Sequence[str], period_s: float
) -> None:
    """Draw the velocity error of some joints with its envelope, where it is judged; red where it does not hold zero.

    Args:
        axes: one for each of the joints.
        run: an impact with `plan`, `t`, `q`, `dq` and `r`.
        config: the classifier.
        joints: their indices.
        titles: one for each.
        period_s: time between two samples [s].
    """
    aim = AimAware(run.plan, config)
    trace = aim.trace(run.t, run.q, run.dq, run.r)
    result = aim.result
    first, last = result.impact_s[0], result.impact_s[max(result.judged - 1, 0)]
    shown = (run.t >= first - 0.02) & (run.t <= last + config.xi_s + 0.02)
    judged = (run.t >= last + config.m_c * period_s) & (run.t <= last + config.xi_s)
    margins = config.margins(run.q.shape[1])
    for ax, i, title in zip(axes, joints, titles, strict=True):
        low, high = trace.lower[:, i] - margins[i], trace.upper[:, i] + margins[i]
        ax.plot(run.t[shown], trace.e_vel[shown, i], color=_BLUE, lw=1)
        ax.fill_between(run.t[judged], low[judged], high[judged], color=_LIGHT, lw=0)
        ax.fill_between(run.t[judged], 0, np.maximum(low[judged], 0), color=_RED, alpha=0.6, lw=0)
        ax.fill_between(run.t[judged], np.minimum(high[judged], 0), 0, color=_RED, alpha=0.6, lw=0)
        for time in result.impact_s:
            ax.axvline(time, color=_GREY, lw=0.8, ls=":")
        ax.set_ylim(-1.3, 1.3)
        ax.set_title(f"{title}: {result.verdict}", fontsize=9)
