"""The part of the verb `tune` that is about planned impacts."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn
from rich.table import Table

from tactful.errors import TactfulError

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from tactful.classification import AimAwareConfig
    from tactful.learning import ImpactTuning, LabelledImpact
    from tactful.monitor import MonitorConfig

_LEARN, _HELD_OUT = 600, 300
"""Simulated impacts to tune on and to hold out."""
_REACH_DEG = 10.0
_PLAN = ".plan.npz"
"""How the name of a recording's own plan ends."""
_SHOWN = 5
"""Impacts told wrongly of each kind that are named."""
_UNITS = {"e_m_rad_s": "rad/s", "epsilon_rad": "rad", "zeta_s": "s", "iota_s": "s", "tilt_deg": "deg"}


def tune_aim_aware(
    paths: Sequence[Path],
    output: Path | None,
    *,
    plan: Path | None,
    tolerance_deg: float,
    tilt: bool,
    trials: int,
    seed: int,
    confidence: float,
    robot: str | None,
    tip: str | None,
    config: Path | None,
    mapping: Path | None,
) -> int:
    """Tune on some impacts, measure on others, say both, and write the settings."""
    from tactful.learning import LearningError, tune_impacts

    if trials < 3 or seed < 0:
        raise TactfulError(f"--trials is {trials} and --seed {seed}: give at least 3 trials, and a seed from 0 on")
    if tolerance_deg < 0 or tolerance_deg >= _REACH_DEG:
        raise TactfulError(f"--tolerance-deg is {tolerance_deg:g}: it has to be at least 0 and below {_REACH_DEG:g}")
    console = Console(stderr=True)
    columns = (TextColumn("{task.description}"), BarColumn(), TextColumn("{task.percentage:3.0f} %"))
    with Progress(
        *columns, TimeRemainingColumn(), console=console, transient=True, disable=not console.is_terminal
    ) as bar:
        task = bar.add_task("reading" if paths else "simulating impacts", total=1.0)
        if paths:
            settings, runs = _recorded(paths, plan, robot, tip, config, mapping)
        elif plan is not None or robot is not None:
            raise TactfulError(
                "which recordings? Name some, or leave --plan and --robot out to simulate the planar arm"
            )
        else:
            settings, runs = _simulated(config, tolerance_deg, seed)
        learn, held_out = _split(runs, seed)
        bar.update(task, description="tuning")
        tuning = tune_impacts(
            learn,
            base=settings.aim_aware,
            tilt=tilt,
            trials=trials,
            seed=seed,
            progress=lambda share: bar.update(task, completed=share),
        )
    if not held_out:
        raise LearningError("no impact is left to measure on: give more recordings")
    _report(tuning, learn, held_out, confidence)
    if output is not None:
        settings.model_copy(update={"aim_aware": tuning.config}).save(output)
        console.print(f"[dim]saved {output}[/dim]", highlight=False)
    return 0


def _recorded(
    paths: Sequence[Path],
    plan: Path | None,
    robot: str | None,
    tip: str | None,
    config: Path | None,
    mapping: Path | None,
) -> "tuple[MonitorConfig, list[LabelledImpact]]":
    from tactful.cli._labelled import settings_of
    from tactful.evaluation import find_recordings
    from tactful.impacts import ImpactPlan
    from tactful.learning import LabelledImpact
    from tactful.recordings import Recording

    settings = settings_of(config, robot, tip)
    arm = settings.robot.load()
    assert arm is not None
    common = None if plan is None else ImpactPlan.load(plan)
    if common is not None and common.contacts:
        common = common.with_turn(arm)
    runs = []
    for file in (file for file in find_recordings(paths) if not file.name.endswith(_PLAN)):
        recording = Recording.read(file, mapping=mapping)
        own = common
        if own is None:
            own = ImpactPlan.load(file.with_name(file.name.partition(".")[0] + _PLAN))
            own = own.with_turn(arm) if own.contacts else own
        runs.append(LabelledImpact.of_recording(recording, own, arm, settings))
    return settings, runs


def _simulated(config: Path | None, tolerance_deg: float, seed: int) -> "tuple[MonitorConfig, list[LabelledImpact]]":
    """Simulate impacts of the planar arm from random directions, on random places and inclinations."""
    import math

    import numpy as np

    from tactful.estimation import ObserverConfig
    from tactful.learning import planar_impacts
    from tactful.monitor import MonitorConfig
    from tactful.simulation.planar import PlanarConfig

    planar = PlanarConfig()
    settings = MonitorConfig(observer=ObserverConfig(joint_flexibility=True)) if config is None else None
    settings = settings or MonitorConfig.load(config)  # type: ignore[arg-type]
    slow = settings.aim_aware.model_copy(update={"bandwidth_hz": planar.observer_gain / (2 * math.pi)})
    rng = np.random.default_rng(seed)
    count = _LEARN + _HELD_OUT
    inside = rng.uniform(-tolerance_deg, tolerance_deg, count)
    beta = np.where(rng.uniform(size=count) < 0.5, inside, rng.uniform(-_REACH_DEG, _REACH_DEG, count))
    edges = np.resize([-tolerance_deg, tolerance_deg], count // 10)
    beta[: len(edges)] = edges  # where thresholds are decided
    cases = np.column_stack([rng.uniform(60, 120, count), rng.uniform(0.2, 0.4, count), beta])
    return settings.model_copy(update={"aim_aware": slow}), planar_impacts(cases, planar, tolerance_deg, seed)


def _split(runs: "list[LabelledImpact]", seed: int) -> "tuple[list[LabelledImpact], list[LabelledImpact]]":
    """Hold out a third of each kind at random."""
    import numpy as np

    learn, held_out = [], []
    rng = np.random.default_rng([seed, 1])
    for kind in (True, False):
        members = [run for run in runs if run.expected == kind]
        order = rng.permutation(len(members))
        held_out += [members[i] for i in order[: len(members) // 3]]
        learn += [members[i] for i in order[len(members) // 3 :]]
    return learn, held_out


def _report(
    tuning: "ImpactTuning", learn: "list[LabelledImpact]", held_out: "list[LabelledImpact]", confidence: float
) -> None:
    import numpy as np

    from tactful.learning import Judged, upper_bound

    console = Console(highlight=False)
    table = Table(box=None, pad_edge=False, header_style="dim")
    table.add_column("setting")
    for heading in ("value", "needed", "by"):
        table.add_column(heading, justify="right" if heading != "by" else "left")
    config = tuning.config
    for name, needed in tuning.needed.items():
        value = getattr(config, name)
        table.add_row(name, f"{value:.4g} {_UNITS[name]}", f"{needed:.4g}", tuning.needed_by[name])
    for name in ("a_per_s", "m_max", "m_c", "xi_s"):
        table.add_row(name, f"{getattr(config, name):.4g}", "", "kept" if name == "xi_s" else "searched")
    rates = tuning.rates
    assert rates is not None
    for joint, (bound, usual) in enumerate(
        zip(np.ravel(config.impact.r_b_nm_s), rates.usual_nm_s, strict=True), start=1
    ):
        ends = rates.noise * usual, rates.weakest * usual
        between = f"{ends[0]:.4g} Nm/s is noise, {ends[1]:.4g} the weakest expected impact"
        table.add_row(f"r_b of joint {joint}", f"{bound:.4g} Nm/s", "", between if np.isfinite(usual) else "not used")
    console.print(table)
    outside = sum(not run.expected for run in learn)
    said = f"tuned on {len(learn)} impacts: all {len(learn) - outside} expected ones are accepted"
    console.print(f"{said}, and {100 * tuning.accepted_outside:.3g} % of the {outside} others", soft_wrap=True)
    if tuning.nearest is not None:
        name, threshold = tuning.nearest
        text = f"the next one would be accepted by thresholds {tuning.gap:.3g} times as large"
        console.print(f"{text}: {name}, which {threshold} refuses", soft_wrap=True)
    accepted = Judged.of(held_out, config).accepted(config)
    for kind, wrong, verb in ((True, ~accepted, "refused"), (False, accepted, "accepted")):
        rows = [i for i, run in enumerate(held_out) if run.expected == kind]
        count = int(wrong[rows].sum())
        bound = upper_bound(count, len(rows), confidence)
        text = f"held out: {count} of {len(rows)} {'expected' if kind else 'other'} impacts {verb}"
        console.print(f"{text}; at most {100 * bound:.2g} % at {100 * confidence:g} % confidence", soft_wrap=True)
        for i in [i for i in rows if wrong[i]][:_SHOWN]:
            console.print(f"  {verb}: {held_out[i].name}", soft_wrap=True)
    if config.tilt_deg is None and (tuning.accepted_outside > 0 or (accepted & ~_expected(held_out)).any()):
        console.print(_with_tilt(config, learn, held_out), soft_wrap=True)


def _with_tilt(config: "AimAwareConfig", learn: "list[LabelledImpact]", held_out: "list[LabelledImpact]") -> str:
    """Say what judging the tilt of the tool would change."""
    from tactful.learning import Judged, thresholds_for

    if any(run.plan.turn is None for run in (*learn, *held_out)):
        return "plans with contact points could be tuned with --tilt: the rotation of the tool tells them, too"
    thresholds = thresholds_for(Judged.of(learn, config), _expected(learn), tilt=True)
    assert thresholds is not None
    sharper = config.model_copy(update=thresholds)
    accepted, expected = Judged.of(held_out, sharper).accepted(sharper), _expected(held_out)
    others = f"{(accepted & ~expected).sum()} of {(~expected).sum()} others would be accepted"
    refused = f"{(~accepted & expected).sum()} of {expected.sum()} expected ones refused"
    return f"with --tilt, where the rotation of the tool is judged, too: held out, {others} and {refused}"


def _expected(runs: "list[LabelledImpact]") -> "NDArray[np.bool_]":
    import numpy as np

    return np.array([run.expected for run in runs], dtype=bool)
