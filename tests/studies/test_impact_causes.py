"""The study of impact causes: that it learns from its runs, holds others out, and writes what it says."""

import json
from pathlib import Path

import numpy as np
import pytest

from tactful.classification import ImpactCauses
from tactful.errors import TactfulError
from tactful.simulation.planar import SensorsConfig, planar_robot
from tactful.studies.impact_causes import TASKS, impact_causes_study, planar_causes, simulate_causes


def test_a_small_study(tmp_path: Path) -> None:
    """A few runs do for the inclination, which is geometry; its target holds."""
    shares: list[float] = []
    summary = impact_causes_study(tmp_path, learn=20, test=2, progress=shares.append)
    assert shares == sorted(shares)
    assert shares[-1] == pytest.approx(1.0)
    assert json.loads((tmp_path / "summary.json").read_text(encoding="utf-8")) == summary
    assert "fixed, smooth surface; noisy sensors" in (tmp_path / "tables.md").read_text(encoding="utf-8")
    for name, task in TASKS.items():
        felt = set(task.causes) - {"missed"}
        assert ImpactCauses.load(tmp_path / f"causes-{name}.npz").causes == tuple(sorted(felt))
        assert all(sum(row.values()) == 2 for row in summary[name]["clean"]["confusion"].values())
    assert all(target["met"] for target in summary["targets"])
    assert summary["fixed"]["clean"]["right"]["value"] > 0.6
    assert summary["fixed"]["clean"]["confusion"]["missed"] == {"missed": 2}
    assert [sum(row["told"].values()) for row in summary["partial"]] == [2] * len(summary["partial"])


def test_runs_depend_on_the_seed_alone() -> None:
    """The same generator makes the same runs, so a study can be repeated."""
    noisy = SensorsConfig(encoder_noise_rad=1e-5)
    first, second = (simulate_causes("object", 1, np.random.default_rng(3), sensors=noisy) for _ in range(2))
    assert [run.cause for run in first] == list(TASKS["object"].causes)
    for a, b in zip(first, second, strict=True):
        np.testing.assert_array_equal(a.result.mean_error_rad_s, b.result.mean_error_rad_s)


def test_too_few_runs(tmp_path: Path) -> None:
    """A model of three runs would be noise."""
    with pytest.raises(TactfulError, match="learn from at least 10"):
        impact_causes_study(tmp_path, learn=2, test=1)
    for options in ({"learn": 0}, {"test": 0}, {"seed": -1}):
        with pytest.raises(TactfulError, match="seed from 0 on"):
            impact_causes_study(tmp_path, **options)


def test_the_shipped_model_tells_other_runs() -> None:
    """What the demo shows rests on it: it has to fit today's simulation, settings and features."""
    model, robot = planar_causes(), planar_robot()
    assert model.causes == tuple(sorted(set(TASKS["fixed"].causes) - {"missed"}))
    runs = simulate_causes("fixed", 2, np.random.default_rng(11))
    right = [model.tell(run.result, run.plan, robot).cause == run.cause for run in runs]
    assert np.mean(right) > 0.85
