"""The demonstration of planned impacts: one as it was planned, one on a surface that is inclined."""

import math
import time
from pathlib import Path
from typing import TYPE_CHECKING

from rich.console import Console
from rich.table import Table
from rich.text import Text

from tactful.cli.monitor import KIND_STYLES
from tactful.errors import TactfulError

if TYPE_CHECKING:
    from tactful.classification import AimAwareConfig
    from tactful.monitor import ContactEvent, Monitor
    from tactful.simulation.planar import PlanarConfig, PlanarImpact

_BETA_DEG = (0.0, 5.0)


def demo_impact(out: Path, seed: int) -> int:
    """Let a planar arm strike a surface twice, tell what the monitor says, and draw it."""
    import numpy as np

    from tactful.estimation import ObserverConfig
    from tactful.monitor import Monitor, MonitorConfig
    from tactful.simulation.planar import PlanarConfig, planar_robot, simulate_impact
    from tactful.studies.impact_causes import CONFIG, planar_causes

    out.mkdir(parents=True, exist_ok=True)
    console = Console(highlight=False)
    rng = np.random.default_rng(seed)
    alpha_deg, x_m = float(rng.uniform(75, 105)), float(rng.uniform(0.25, 0.35))
    planar, causes = PlanarConfig(impact=CONFIG.impact), planar_causes()
    config = MonitorConfig(observer=ObserverConfig(joint_flexibility=True), aim_aware=CONFIG)
    console.print(
        f"A planar arm comes down at {planar.task.speed_m_s:g} m/s, {alpha_deg:.0f} deg to the surface it was told of, "
        "and is to stay on it.",
        soft_wrap=True,
    )
    with console.status("simulating; the first time ever, kernels are compiled for about a minute"):
        runs = [simulate_impact(alpha_deg, x_m, beta, planar) for beta in _BETA_DEG]
        monitor = Monitor(planar_robot(), config, plan=runs[0].plan)
        monitor.run(runs[0].recording())
    begin = time.perf_counter()
    table = Table(box=None, pad_edge=False, header_style="dim")
    for heading in ("surface inclined by", "the monitor says", "reason", "tool tilted by", "first said", "decided"):
        table.add_column(heading)
    for run in runs:
        monitor = Monitor(planar_robot(), config, plan=run.plan, causes=causes)
        told = [event for row in zip(run.t, run.q, run.dq, run.tau, strict=True) if (event := monitor.update(*row))]
        impacts = [event for event in told if event.kind.endswith("impact")]
        console.print(
            f"\nThe surface is inclined by {run.beta_deg:g} deg; it is struck at {run.touches[0].time_s:.3f} s."
        )
        last = ("", "")
        for event in impacts:
            why = event.evidence[0].text.partition(": ")[2] if event.evidence else ""
            if last == (last := (event.kind, why)):
                continue
            said = Text(event.kind.replace("_", " ").ljust(18), style=KIND_STYLES[event.kind])
            console.print(f"[dim]{event.detected_s:6.3f} s[/dim]", said, f"[dim]{why}[/dim]", soft_wrap=True)
        table.add_row(f"{run.beta_deg:g} deg", *_row(impacts, run, monitor))
    console.print()
    console.print(table)
    console.print(f"[dim]both impacts monitored in {time.perf_counter() - begin:.1f} s, one sample at a time[/dim]\n")
    try:
        _draw(runs, CONFIG, planar, out / "impact.png")
    except TactfulError as error:
        console.print(f"no picture: {error}", soft_wrap=True)
    else:
        text = "  the arm at the verdict, and the velocity error with its envelope"
        console.print(Text(f"{out / 'impact.png'}{text}"), soft_wrap=True)
    return 0


def _row(impacts: "list[ContactEvent]", run: "PlanarImpact", monitor: "Monitor") -> tuple[str | Text, ...]:
    result, cause = monitor.impact, monitor.impact_cause
    if not impacts or result is None or result.decided_s is None:
        return Text("nothing", style="yellow"), "", "", "", ""
    last, touch_s = impacts[-1], run.touches[0].time_s
    return (
        Text(last.kind.replace("_", " "), style=KIND_STYLES[last.kind]),
        "" if last.reason is None or cause is None else f"{last.reason}, {100 * cause.confidence:.0f} % sure",
        f"{result.tilt_deg:.1f} deg",
        f"{(impacts[0].detected_s - touch_s) * 1e3:+.0f} ms",
        f"{(result.decided_s - touch_s) * 1e3:+.0f} ms",
    )


def _draw(runs: "list[PlanarImpact]", aim: "AimAwareConfig", planar: "PlanarConfig", file: Path) -> None:
    import numpy as np

    from tactful._plotting import STYLE, matplotlib
    from tactful.classification import AimAware

    mpl = matplotlib()
    with mpl.rc_context(STYLE):
        figure = mpl.figure.Figure(figsize=(9.5, 5.6), layout="constrained")
        for (scene, error), run in zip(figure.subplots(2, 2, width_ratios=(1, 2)), runs, strict=True):
            watch = AimAware(run.plan, aim)
            trace = watch.trace(run.t, run.q, run.dq, run.r)
            result = watch.result
            angles = np.cumsum(run.q[int(np.searchsorted(run.t, result.decided_s or run.t[-1]))])
            steps = np.array(planar.arm.length_m)[:, None] * np.stack([np.cos(angles), np.sin(angles)], axis=1)
            joints = np.vstack([np.zeros(2), np.cumsum(steps, axis=0)])  # (4, 2)
            face = np.array(planar.arm.offsets_m)[:, None] * [-np.sin(angles[2]), np.cos(angles[2])] + joints[3]
            beta = math.radians(run.beta_deg)
            along = np.linspace(-0.25, 0.25, 2)[:, None] * [math.cos(beta), math.sin(beta)]
            surface = along + np.array([run.x_imp_m, planar.task.height_m])
            scene.plot(*surface.T, color="#8a8f98", lw=3)
            scene.plot(*joints.T, "o-", color="#2e74b5", lw=3, ms=5)
            scene.plot(*face.T, color="#22262b", lw=3)
            scene.set(aspect="equal", xlabel="x [m]", ylabel="y [m]")
            scene.set_title(f"surface inclined by {run.beta_deg:g} deg: {result.verdict}", fontsize=9)
            i = max(range(3), key=lambda k: result.joints[k].needed_rad_s)
            first, last = result.impact_s[0], result.impact_s[result.judged - 1]
            shown = (run.t > first - 0.03) & (run.t < last + aim.xi_s + 0.03)
            judged = (run.t >= last + aim.m_c * planar.period_s) & (run.t <= last + aim.xi_s)
            margin = float(aim.margins(3)[i])
            low, high = trace.lower[:, i] - margin, trace.upper[:, i] + margin
            error.fill_between(
                run.t[judged], low[judged], high[judged], color="#cfe0f1", lw=0, label="envelope, margin"
            )
            for edge in (np.maximum(low, 0), np.minimum(high, 0)):
                error.fill_between(run.t[judged], 0, edge[judged], color="#d9534f", alpha=0.6, lw=0)
            error.plot(run.t[shown], trace.e_vel[shown, i], color="#2e74b5", lw=1, label="velocity error")
            error.axhline(0, color="#22262b", lw=0.6)
            error.set(xlabel="time [s]", ylabel="[rad/s]", ylim=(-1.2, 1.2))
            holds = "the envelope holds" if result.verdict == "expected" else "red: the envelope violates"
            error.set_title(f"joint {i + 1}: {holds} zero", fontsize=9)
            error.legend(loc="lower right", frameon=False)
        figure.savefig(file, dpi=130)
