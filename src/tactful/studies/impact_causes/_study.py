"""How well it is told what went wrong with an impact."""

from __future__ import annotations

import itertools
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from tactful.classification import ImpactCause, ImpactCauses, impact_features
from tactful.evaluation import Share
from tactful.simulation.planar import SensorsConfig, planar_robot
from tactful.studies.impact_causes._runs import CAUSES, ImpactRun, simulate_causes

_SENSORS = {
    "clean": SensorsConfig(),
    "noisy": SensorsConfig(encoder_noise_rad=1e-5, torque_noise_nm=0.05, velocity_cutoff_hz=100.0),
}
"""What is learnt from, half and half, and measured on."""
_TILTED = ("as planned", "inclined +", "inclined -")
_CONFIDENCE = (0.0, 0.7, 0.9, 0.99, 1.0)


def impact_causes_study(
    out: str | Path,
    *,
    learn: int = 80,
    test: int = 60,
    seed: int = 0,
    progress: Callable[[float], None] = lambda share: None,
) -> dict[str, Any]:
    """Learn the causes from simulated runs and measure them on others; write causes.npz, summary.json and tables.md.

    Args:
        out: folder for the results.
        learn: runs of each cause to learn from, half with clean and half with noisy sensors.
        test: runs of each cause to measure on, with clean and with noisy sensors each.
        seed: what all runs are drawn from.
        progress: called with the share that is done.

    Raises:
        TactfulError: if there are too few runs to learn from.
    """
    rng = np.random.default_rng(seed)
    robot = planar_robot()
    known = []
    for k, sensors in enumerate(_SENSORS.values()):
        known += [run for run in simulate_causes(learn // 2, rng, sensors=sensors) if run.result.judged]
        progress((k + 1) / 4)
    model = ImpactCauses.learn(
        [impact_features(run.result, run.plan, robot) for run in known], [run.cause for run in known]
    )
    summary: dict[str, Any] = {"seed": seed, "runs_per_cause": {"learn": learn, "test": test}}
    for k, (name, sensors) in enumerate(_SENSORS.items()):
        summary[name] = _measure(model, simulate_causes(test, rng, sensors=sensors))
        progress((k + 3) / 4)
    summary["targets"] = [
        {
            "what": f"inclination within 8 deg, mean error, {name} sensors [deg]",
            "target": "<= 1",
            "reached": summary[name]["inclination_mae_deg"],
            "met": summary[name]["inclination_mae_deg"] <= 1,
        }
        for name in _SENSORS
    ]
    folder = Path(out)
    folder.mkdir(parents=True, exist_ok=True)
    model.save(folder / "causes.npz")
    (folder / "summary.json").write_text(json.dumps(summary, indent=1) + "\n", encoding="utf-8")
    (folder / "tables.md").write_text(_tables(summary), encoding="utf-8")
    return summary


def _measure(model: ImpactCauses, runs: list[ImpactRun]) -> dict[str, Any]:
    robot = planar_robot()
    told = [(run, model.tell(run.result, run.plan, robot)) for run in runs]
    correct = np.array([run.cause == what.cause for run, what in told])
    sure = np.array([what.confidence for _, what in told])
    tilted = [
        abs(what.tilt_deg[2] - run.beta_deg) for run, what in told if what.tilt_deg is not None and run.cause in _TILTED
    ]
    return {
        "right": Share(int(correct.sum()), len(runs)).to_dict(),
        "confusion": {cause: _row(cause, told) for cause in CAUSES},
        "inclination_mae_deg": float(np.mean(tilted)),
        "inclination_largest_error_deg": float(np.max(tilted)),
        "confidence": [
            {"from": low, "to": high, "runs": int(here.sum()), "right": float(correct[here].mean())}
            for low, high in itertools.pairwise(_CONFIDENCE)
            if (here := (sure >= low) & ((sure < high) | (high == 1.0))).any()
        ],
    }


def _row(cause: str, told: list[tuple[ImpactRun, ImpactCause]]) -> dict[str, int]:
    answers = [what.cause for run, what in told if run.cause == cause]
    return {name: answers.count(name) for name in (*CAUSES, "missed", "unknown")}


def _tables(summary: dict[str, Any]) -> str:
    lines = []
    for name in _SENSORS:
        part = summary[name]
        right, confusion = part["right"], part["confusion"]
        columns = [c for c in (*CAUSES, "missed", "unknown") if any(row[c] for row in confusion.values())]
        lines += [
            f"## {name} sensors",
            "",
            f"Right: {right['value']:.1%} (95 % interval {right['low']:.1%} to {right['high']:.1%}).",
            f"Inclination: mean error {part['inclination_mae_deg']:.2f} deg, "
            f"largest {part['inclination_largest_error_deg']:.2f} deg.",
            "",
            "| was \\ told | " + " | ".join(columns) + " |",
            "| --- |" + " --- |" * len(columns),
            *(f"| {cause} | " + " | ".join(str(row[c]) for c in columns) + " |" for cause, row in confusion.items()),
            "",
            "| confidence | runs | right |",
            "| --- | --- | --- |",
            *(f"| {b['from']:g}-{b['to']:g} | {b['runs']} | {b['right']:.0%} |" for b in part["confidence"]),
            "",
        ]
    return "\n".join(lines)
