"""How well it is told what went wrong with an impact."""

from __future__ import annotations

import itertools
import json
from collections.abc import Callable, Sequence
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np

from tactful.classification import ImpactCause, ImpactCauses, impact_features
from tactful.errors import TactfulError
from tactful.evaluation import Share
from tactful.simulation.planar import SensorsConfig, planar_robot
from tactful.studies.impact_causes._causes import TASKS, Cause, Parts, Task
from tactful.studies.impact_causes._runs import ImpactRun, simulate_cause, simulate_causes
from tactful.studies.impact_causes._tables import tables

_SENSORS = {
    "clean": SensorsConfig(),
    "noisy": SensorsConfig(encoder_noise_rad=1e-5, torque_noise_nm=0.05, velocity_cutoff_hz=100.0),
}
"""What is learnt from, half and half, and measured on."""
_TILTED = ("as planned", "inclined +", "inclined -")
_CONFIDENCE = (0.0, 0.7, 0.9, 0.99, 1.0)
_HELD = (0.95, 0.9, 0.85, 0.8, 0.75, 0.7, 0.6, 0.55, 0.5, 0.45, 0.4, 0.3, 0.2, 0.1)
"""Shares of the tool's face that the surface holds, for what is told of them."""

_SHRINKAGE, _FLOOR = 0.03, 0.03
"""Of the covariances; less than what `ImpactCauses.learn` takes for a few dozen runs of each cause."""

Told = list[tuple[ImpactRun, ImpactCause]]


def impact_causes_study(
    out: str | Path,
    *,
    learn: int = 160,
    test: int = 60,
    seed: int = 0,
    progress: Callable[[float], None] = lambda share: None,
) -> dict[str, Any]:
    """Learn the causes from simulated runs and measure them on others, for each kind of plan.

    Writes summary.json, tables.md, and a model for each of `TASKS`, causes-fixed.npz and so on.

    Args:
        out: folder for the results.
        learn: runs of each cause to learn from, half with clean and half with noisy sensors.
        test: runs of each cause to measure on, with clean and with noisy sensors each.
        seed: what all runs are drawn from.
        progress: called with the share that is done.

    Raises:
        TactfulError: if there are too few runs to learn from or to measure on, or the seed is negative.
    """
    if learn < 2 or test < 1 or seed < 0:
        problem = "learn from some runs of each cause, measure on at least one, and take a seed from 0 on"
        raise TactfulError(f"learn is {learn}, test {test} and seed {seed}: {problem}")
    rng = np.random.default_rng(seed)
    total = sum(len(task.causes) for task in TASKS.values()) * (learn + 2 * test) + len(_HELD) * test
    done = 0

    def count(runs: list[ImpactRun]) -> list[ImpactRun]:
        nonlocal done
        done += len(runs)
        progress(done / total)
        return runs

    folder = Path(out)
    folder.mkdir(parents=True, exist_ok=True)
    summary: dict[str, Any] = {"seed": seed, "runs_per_cause": {"learn": learn, "test": test}}
    for name, task in TASKS.items():
        known = [
            run
            for sensors in _SENSORS.values()
            for run in count(simulate_causes(name, learn // 2, rng, sensors=sensors))
        ]
        model = _learn(known)
        model.save(folder / f"causes-{name}.npz")
        summary[name] = {
            which: _measure(_tell(model, count(simulate_causes(name, test, rng, sensors=sensors))), task)
            for which, sensors in _SENSORS.items()
        }
        if name == "fixed":
            summary["partial"] = [
                {"held": held, "told": _counts(_tell(model, count(_partial(held, task, test, rng))))} for held in _HELD
            ]
    summary["targets"] = [
        {
            "what": f"inclination within 8 deg, mean error, {which} sensors [deg]",
            "target": "<= 1",
            "reached": summary["fixed"][which]["inclination_mae_deg"],
            "met": summary["fixed"][which]["inclination_mae_deg"] <= 1,
        }
        for which in _SENSORS
    ]
    (folder / "summary.json").write_text(json.dumps(summary, indent=1) + "\n", encoding="utf-8")
    (folder / "tables.md").write_text(tables(summary), encoding="utf-8")
    return summary


def planar_causes() -> ImpactCauses:
    """Return what the study learns by default of the planar arm on a fixed, smooth surface, judged as `CONFIG` says."""
    with resources.as_file(resources.files("tactful.studies.impact_causes") / "causes-fixed.npz") as file:
        return ImpactCauses.load(file)


def _learn(runs: Sequence[ImpactRun]) -> ImpactCauses:
    """Learn the causes of the impacts that were felt."""
    felt = [run for run in runs if run.result.judged]
    robot = planar_robot()
    features = [impact_features(run.result, run.plan, robot) for run in felt]
    return ImpactCauses.learn(features, [run.cause for run in felt], shrinkage=_SHRINKAGE, floor=_FLOOR)


def _tell(model: ImpactCauses, runs: Sequence[ImpactRun]) -> Told:
    robot = planar_robot()
    return [(run, model.tell(run.result, run.plan, robot)) for run in runs]


def _partial(held: float, task: Task, runs: int, rng: np.random.Generator) -> list[ImpactRun]:
    """Simulate impacts in which the surface holds a share of the tool's face, on one side or the other."""
    found = []
    for number in range(runs):
        end_m = (2 * held - 1) * 0.1
        parts: Parts = {"surface": {"end_m": end_m} if number % 2 else {"begin_m": -end_m}}
        found.append(simulate_cause("partial", Cause(lambda rng, parts=parts: parts), task, rng))  # type: ignore[misc]
    return found


def _measure(told: Told, task: Task) -> dict[str, Any]:
    correct = np.array([run.cause == what.cause for run, what in told])
    felt = np.array([run.result.judged > 0 for run, _ in told])
    sure = np.array([what.confidence for _, what in told])
    tilted = [
        abs(what.tilt_deg[2] - run.beta_deg) for run, what in told if what.tilt_deg is not None and run.cause in _TILTED
    ]
    return {
        "right": Share(int(correct.sum()), len(told)).to_dict(),
        "confusion": {cause: _counts([x for x in told if x[0].cause == cause]) for cause in task.causes},
        "wrong_alpha_deg": {cause: _directions([x for x in told if x[0].cause == cause]) for cause in task.causes},
        "inclination_mae_deg": float(np.mean(tilted)),
        "inclination_largest_error_deg": float(np.max(tilted)),
        "confidence": [
            {"from": low, "to": high, "runs": int(here.sum()), "right": float(correct[here].mean())}
            for low, high in itertools.pairwise(_CONFIDENCE)
            if (here := felt & (sure >= low) & ((sure < high) | (high == 1.0))).any()
        ],
    }


def _directions(told: Told) -> list[float] | None:
    """Return the smallest and the largest angle of approach of the impacts that are told wrongly [deg]."""
    wrong = [run.alpha_deg for run, what in told if run.cause != what.cause]
    return [min(wrong), max(wrong)] if wrong else None


def _counts(told: Told) -> dict[str, int]:
    answers = [what.cause for _, what in told]
    return {name: answers.count(name) for name in sorted(set(answers))}
