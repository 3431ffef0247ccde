"""The figures of the study: bands of the published and of tuned settings, robustness, targets."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tactful.classification import AimAwareConfig
from tactful.detection import ImpactConfig
from tactful.errors import TactfulError
from tactful.learning import Judged, LearningError, planar_impacts, thresholds_for, tune_impacts, within
from tactful.simulation.planar import PlanarConfig
from tactful.studies._parallel import results
from tactful.studies.aim_aware._bands import Bands
from tactful.studies.aim_aware._evidence import judge
from tactful.studies.aim_aware._targets import targets
from tactful.studies.aim_aware._variants import STEP_DEG, Grid, Variant, held_out, paper_grid, training, variants

Array = NDArray[np.float64]
Figures = dict[str, Any]

TOLERANCE_DEG: Mapping[str, float] = {"strict": 0.0, "medium": 2.0, "wide": 4.0}
"""The sets of the paper by the inclination that they always accept."""
R_B_TABLE1 = ImpactConfig(r_b_nm_s=(4000.0, 4000.0, float("inf")), refractory_s=0.0)
"""r_b with which the published sets are judged: the paper gives none."""
_TRIALS, _TRIALS_VARIANT, _TRIALS_TILT = 24, 8, 4
"""Envelopes and r_b that are tried: for the assumed arm, for others, and where the tilt is judged, too."""

ROBUST = ("tuned", "tilt", "early")
"""How the sets are judged that are measured on what differs from the assumed arm."""

Sets = dict[str, AimAwareConfig]
TuneTask = tuple[Variant, Array, int, int]


def summarise(
    grid: Grid,
    planar: PlanarConfig,
    seed: int,
    jobs: int,
    client: Any = None,
    progress: Callable[[float], None] = lambda share: None,
) -> tuple[Figures, dict[str, Array]]:
    """Simulate, judge, tune and count.

    Returns:
        The content of `summary.json`, and what the tables rest on, impact by impact.

    Raises:
        TactfulError: if the grid is unknown or a number is out of range.
    """
    if grid not in STEP_DEG:
        raise TactfulError(f"grid {grid!r} is unknown: there are {', '.join(STEP_DEG)}")
    if seed < 0:
        raise TactfulError(f"seed is {seed}: it has to be at least 0")
    if jobs < 1:
        raise TactfulError(f"jobs is {jobs}: it has to be at least 1")
    learn, unseen, sweep = training(0.25, 5, 3), held_out(0.25, 7, 5), paper_grid(grid)
    few, many = (training(0.5, 4, 3), held_out(0.5, 4, 3)), list(variants(planar))
    total = 5 * len(learn) + len(unseen) + len(sweep) + len(many) * (3 * len(few[0]) + len(few[1]))
    done = 0

    def count(impacts: int) -> None:
        nonlocal done
        done += impacts
        progress(done / total)

    tasks: list[TuneTask] = [(Variant("assumed", planar), learn, _TRIALS, seed)]
    tasks += [(variant, few[0], _TRIALS_VARIANT, seed) for variant in many]
    tuned: dict[int, dict[str, Sets]] = {}
    for number, sets in results(_tune, tasks, jobs=jobs, client=client):
        tuned[number] = sets
        count(len(tasks[number][1]) * (3 if number else 5))
    if any(set(sets) != set(TOLERANCE_DEG) for sets in tuned[0].values()):
        raise TactfulError("the arm cannot be tuned: an impact within the tolerance is not felt")
    groups: dict[str, Sets] = {
        "table1": {name: AimAwareConfig.table1(name, impact=R_B_TABLE1) for name in ("strict", "medium", "wide")},
        **tuned[0],
    }
    configs = [config for group in groups.values() for config in group.values()]
    common: dict[str, Any] = {"seed": seed, "jobs": jobs, "client": client, "progress": count}
    on_grid, spent = judge(sweep, planar, configs, **common)
    on_unseen, _ = judge(unseen, planar, configs, **common)
    figures: Figures = {"grid": grid, "impacts": len(sweep), "seed": seed, "cpu_s": spent}
    evidence: dict[str, Array] = {"grid_cases": sweep, "held_out_cases": unseen}
    for group, members in groups.items():
        figures[group] = {}
        for name, config in members.items():
            k = configs.index(config)
            figures[group][name] = {
                **Bands.of(sweep[:, 2], on_grid[k].accepted(config)).summary(),
                "settings": without_inf(config.model_dump(mode="json")),
                "held_out": Bands.of(unseen[:, 2], on_unseen[k].accepted(config)).summary(),
            }
            evidence[f"grid_{group}_{name}"] = on_grid[k].needed()
            evidence[f"held_out_{group}_{name}"] = on_unseen[k].needed()
    figures |= _inclination(unseen[:, 2], on_unseen[configs.index(groups["tuned"]["wide"])])
    figures["early_inclination"] = _inclination(unseen[:, 2], on_unseen[configs.index(groups["early"]["wide"])])
    figures["robustness"] = []
    for number, variant in enumerate(many, start=1):
        named = {(group, name): c for group in ROBUST for name, c in tuned[number][group].items()}
        found = judge(few[1], variant.planar, list(named.values()), **common)[0] if named else []
        row: Figures = {"variant": variant.name, **{group: {} for group in ROBUST}}
        for group, name in itertools.product(ROBUST, TOLERANCE_DEG):
            row[group][name] = {
                "band_deg": None,
                "kept": False,
                "problem": "an impact within is not felt or not told from noise",
            }
        for (group, name), config, seen in zip(named, named.values(), found, strict=True):
            bands = Bands.of(few[1][:, 2], seen.accepted(config))
            share = bands.within(TOLERANCE_DEG[name])
            row[group][name] = bands.summary() | {"kept": share == 1.0, "accepted_within": share}
        figures["robustness"].append(row)
    figures["targets"] = targets(figures, TOLERANCE_DEG)
    figures["planar"] = without_inf(planar.model_dump())
    return figures, evidence


def _tune(task: TuneTask) -> dict[str, Sets]:
    """Tune to the tolerances that can be tuned to: as the paper judges, with the tilt, in time, and the raw error."""
    variant, learn, trials, seed = task
    runs = planar_impacts(learn, variant.planar, 0.0, seed)
    base = AimAwareConfig(xi_s=variant.xi_s, impact=variant.planar.impact)
    how: dict[str, Any] = {"base": base, "place_r_b": variant.place_r_b, "seed": seed}
    early = how | {"base": base.model_copy(update={"xi_from": "first"})}
    found: dict[str, Sets] = {"tuned": {}, "tilt": {}, "early": {}, "raw": {}}
    for name, tolerance in TOLERANCE_DEG.items():
        expected = within(learn[:, 2], tolerance)
        labelled = [replace(run, expected=bool(yes)) for run, yes in zip(runs, expected, strict=True)]
        try:
            config = tune_impacts(labelled, trials=trials, **how).config
            found["tuned"][name] = config
            found["tilt"][name] = tune_impacts(labelled, trials=_TRIALS_TILT, tilt=True, **how).config
            found["early"][name] = tune_impacts(labelled, trials=_TRIALS_TILT, tilt=True, **early).config
        except LearningError:
            continue
        raw = AimAwareConfig.raw_error(xi_s=variant.xi_s, impact=config.impact)
        thresholds = thresholds_for(Judged.of(runs, raw), expected)
        if thresholds is not None:
            found["raw"][name] = raw.model_copy(update=thresholds)
    return found


def _inclination(beta_deg: Array, seen: Judged) -> Figures:
    """Return how well the turn of the tip in contact tells the inclination, within +-8 deg, and when."""
    rows = within(beta_deg, 8.0) & np.isfinite(seen.tilt_deg)
    error = np.abs(seen.tilt_deg[rows] - beta_deg[rows])
    felt = np.isfinite(seen.verdict_s)
    return {
        "inclination_mae_deg": float(error.mean()),
        "inclination_worst_deg": float(error.max()),
        "inclination_known": float(rows.sum() / within(beta_deg, 8.0).sum()),
        "verdict_after_first_impact_s": _spread(seen.verdict_s[felt]),
        "verdict_after_last_impact_s": _spread(seen.wait_s[felt]),
    }


def _spread(times: Array) -> dict[str, float]:
    return {
        "median": float(np.median(times)),
        "p95": float(np.quantile(times, 0.95)),
        "largest": float(times.max()),
    }


def without_inf(data: Any) -> Any:
    """Replace infinities, which JSON does not know, by text."""
    if isinstance(data, dict):
        return {key: without_inf(value) for key, value in data.items()}
    if isinstance(data, list | tuple):
        return [without_inf(value) for value in data]
    return "inf" if isinstance(data, float) and np.isinf(data) else data
