"""A study so small that it can be a test: the same few episodes in all sets, no calibration and no training."""

from __future__ import annotations

import pytest

from tactful.monitor import MonitorConfig
from tactful.simulation import PEG, EpisodeSpec, draw_plan
from tactful.studies.kinesthetic import _plan, _study, _summary

FREE = draw_plan(1, 5, kinds=("free",))
TOUCHED = [
    *draw_plan(1, 6, kinds=("collision",)),
    *draw_plan(2, 7, kinds=("cooperation",), operators=("brisk", "calm")),
    *draw_plan(1, 8, kinds=("collision_then_cooperation",), operators=("brisk",)),
]


def make_tiny(monkeypatch: pytest.MonkeyPatch) -> None:
    """Replace what takes long."""

    def plan(episodes: int, seed: int) -> dict[str, list[EpisodeSpec]]:
        names = _plan.plan(episodes, seed)
        return {name: FREE if "free" in name or "calibration" in name else TOUCHED for name in names}

    monkeypatch.setattr(_study, "plan", plan)
    fast = MonitorConfig(robot=PEG, classifier="kinesthetic", noise={"torque_nm": 0.05, "model_nm": 0.3})
    monkeypatch.setattr(_summary, "calibrated_monitor", lambda entries, folder, file: fast)
    monkeypatch.setattr(_summary, "trained_monitor", lambda config, *rest, **options: config)
