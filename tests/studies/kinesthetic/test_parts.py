"""The parts of the kinesthetic study, each by itself."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tactful.classification import KinestheticClassifier, KinestheticConfig
from tactful.dynamics import Dynamics
from tactful.errors import TactfulError
from tactful.monitor import MonitorConfig
from tactful.robots import Robot
from tactful.simulation import draw_plan
from tactful.studies.kinesthetic import _published, _score, _tune
from tactful.studies.kinesthetic._onsets import NotedClassifier, onset_of
from tactful.studies.kinesthetic._plan import FOLDS, VARIATIONS, fold_of, plan
from tactful.studies.kinesthetic._store import Store
from tactful.studies.kinesthetic._watch import THRESHOLDS_N, Watch, turned


def note(force: list[float], velocity: list[float]) -> dict[str, Any]:
    """What is noted of an onset."""
    return {
        "t": 1.0,
        "force_change_n": force,
        "velocity_m_s": velocity,
        "velocity_after_m_s": velocity,
        "directions": [True, True, True],
        "in_collision": False,
    }


def test_nobody_is_trained_and_judged_on_at_once() -> None:
    """Else the figures would be those of people that the classifier knows."""
    sets = plan(60, 3)
    trained = {spec.seed for name, specs in sets.items() if "training" in name for spec in specs}
    assert not trained & {spec.seed for spec in sets["evaluation"] + sets["tuning"] + sets["panda evaluation"]}
    for number, spec in enumerate(sets["evaluation"]):
        operators = {other.operator for other in sets[f"training {fold_of(spec, number)}"]}
        assert spec.operator is None or spec.operator not in operators
    assert sorted(name for fold in FOLDS for name in fold) == sorted({s.operator for s in sets["evaluation"]} - {None})


def test_a_small_study_is_a_part_of_a_large_one() -> None:
    """So that what was simulated for the one serves the other."""
    small, large = plan(30, 1), plan(60, 1)
    for name in ("tuning", "calibration", "free", "panda free", "training 1"):
        assert small[name] == large[name][: len(small[name])]


def test_variations_repeat_the_evaluation_with_one_change() -> None:
    """A paired comparison needs the same episodes otherwise."""
    sets = plan(60, 0)
    by_seed = {spec.seed: spec for spec in sets["evaluation"]}
    for name, change in VARIATIONS.items():
        for spec in sets[name]:
            assert spec == by_seed[spec.seed].model_copy(update=change)


@pytest.mark.parametrize(("episodes", "seed"), [(3, 0), (60, -1)])
def test_a_plan_that_cannot_be_is_refused(episodes: int, seed: int) -> None:
    """In one line, before anything is simulated."""
    with pytest.raises(TactfulError, match="at least 9 and 0"):
        plan(episodes, seed)


def test_a_noted_onset_is_told_as_the_onset_was() -> None:
    """The curves over gamma stand on this."""
    rng = np.random.default_rng(0)
    config = KinestheticConfig(gamma=3.0)
    noted = NotedClassifier(KinestheticClassifier(config), config)
    for _ in range(50):
        onset = onset_of(note(rng.normal(size=3).tolist(), (0.2 * rng.normal(size=3)).tolist()))
        verdict = noted.classify(onset)
        assert KinestheticClassifier(config).classify(onset_of(noted.notes[-1])) == verdict


def test_gamma_puts_specificity_first() -> None:
    """A collision that is taken for cooperation reprograms a trajectory, so no sensitivity is worth one."""
    against = [_tune.Told("collision", note([-1.0, 0.2 * i, 0.0], [0.1, 0.01, 0.01]), 2.0) for i in range(4)]
    across = [_tune.Told("cooperation", note([-0.1, -1.0 - i, 0.0], [0.1, 0.01, 0.01]), 1.0) for i in range(4)]
    chosen = _tune.gamma(against + across, "angle")
    at = {point["gamma"]: point for point in _tune.gamma_curve(against + across, "angle")}[chosen]
    assert at["specificity"]["value"] == 1.0
    assert at["sensitivity"]["value"] == max(
        point["sensitivity"]["value"]
        for point in _tune.gamma_curve(against + across, "angle")
        if point["specificity"]["value"] == 1.0
    )


def test_the_force_threshold_is_the_least_without_false_alarms() -> None:
    """The paper's first priority."""
    alarms = [int(threshold < 0.5) for threshold in THRESHOLDS_N]
    row = {"contact_free_s": 10.0, "alarms": alarms, "found_s": []}
    assert _tune.force_threshold([row]) == min(t for t in THRESHOLDS_N if t >= 0.5)
    with pytest.raises(TactfulError, match="without false alarms"):
        _tune.force_threshold([row | {"alarms": [1] * len(THRESHOLDS_N)}])


def test_fisher_tells_what_a_line_divides() -> None:
    """It is the paper's own comparison."""
    rng = np.random.default_rng(1)
    contacts = [
        _tune.Told(kind, note([sign, *(0.1 * rng.normal(size=2))], [0.1, 0.0, 0.0]), 1.0)
        for kind, sign in (("collision", -1.0), ("cooperation", 1.0))
        for _ in range(10)
    ]
    assert _tune.fisher(contacts, contacts)["accuracy"]["value"] == 1.0


def test_turned_axes_turn_the_arm_and_gravity_alike() -> None:
    """The arm has to stay the same in its joints: only what a rule sees of it may differ."""
    panda = Robot.load("panda")
    other = turned(panda)
    q = panda.home + 0.3
    np.testing.assert_allclose(
        Dynamics(other).inverse_dynamics(q, 0.4 * np.ones(7), np.ones(7)),
        Dynamics(panda).inverse_dynamics(q, 0.4 * np.ones(7), np.ones(7)),
        atol=1e-10,
    )
    J, K = Dynamics(panda).jacobian(q), Dynamics(other).jacobian(q)
    np.testing.assert_allclose(np.linalg.norm(J[:3], axis=0), np.linalg.norm(K[:3], axis=0), atol=1e-12)
    assert np.abs(J - K).max() > 0.1


def test_what_is_published_adds_up() -> None:
    """The paper's totals: 192 of 210 right, and Table II is the second row of Table I."""
    table = _published.TABLE_I
    right = sum(table[kind][kind] for kind in table)
    total = sum(sum(row.values()) for row in table.values())
    assert round(100 * right / total, 1) == _published.KINESTHETIC.accuracy
    for said in ("collision", "cooperation"):
        assert sum(row[said] for row in _published.TABLE_II.values()) == table["cooperation"][said]


def _row(labels: list[dict[str, Any]], events: list[dict[str, Any]]) -> dict[str, Any]:
    spec = draw_plan(1, 0, kinds=("cooperation",))[0].model_dump(mode="json")
    base: dict[str, Any] = {
        "phase": "ended",
        "link": None,
        "location": None,
        "directions": [],
        "force_n": [0.0, 0.0, 0.0],
        "peak_force_n": 5.0,
        "torque_ext_nm": [],
        "velocity_m_s": None,
        "confidence": 1.0,
        "evidence": [],
        "reason": None,
        "sigma_min": None,
        "damped": False,
    }
    full = [base | {"id": i, "onset_s": event["detected_s"], **event} for i, event in enumerate(events)]
    times = {"monitored_s": 10.0, "contact_free_s": 8.0, "alarm_s": 0.0, "end_s": 10.0}
    return {"spec": spec, "labels": labels, "events": full, "asked": [], **times}


def test_what_counts_as_missed() -> None:
    """A collision within a collision is more of the same; a person within one is missed."""
    first = {"kind": "collision", "start_s": 1.0, "end_s": 2.0, "peak_force_n": 20.0}
    again = {"kind": "collision", "start_s": 2.5, "end_s": 3.0, "peak_force_n": 9.0}
    helped = {"kind": "cooperation", "start_s": 2.6, "end_s": 4.0, "peak_force_n": 7.0}
    event = {"kind": "collision", "detected_s": 1.01, "end_s": 5.0}
    found = _score.block([_row([first, again, helped], [event])], [])["misses"]
    assert found["continued"] == 1
    assert (found["missed"]["count"], found["missed"]["total"]) == (1, 3)
    assert (found["cooperations"], found["strongest_n"], found["during_another"]) == (1, 7.0, 1)


def test_false_alarms_are_counted_by_the_hour() -> None:
    """In contact-free motion every event is one."""
    event = {"kind": "contact", "detected_s": 1.0, "end_s": 2.0}
    rate = _score.false_alarms([_row([], [event]), _row([], [])])
    assert rate.count == 1
    assert rate.per_hour == pytest.approx(180.0)


def test_rows_are_made_once_and_a_torn_line_again(tmp_path: Path) -> None:
    """So an interrupted study goes on, also after a crash in the middle of a line."""
    made: list[str] = []

    def work(task: Watch) -> dict[str, Any]:
        made.append(task.file.name)
        return {"name": task.file.name}

    tasks = [Watch(tmp_path / name, MonitorConfig()) for name in ("a", "b")]
    store = Store(tmp_path / "rows", 1, None, lambda: None)
    rows = store.rows("some monitor", work, tasks)
    assert [row["name"] for row in rows] == ["a", "b"]
    file = tmp_path / "rows" / "some-monitor.jsonl"
    file.write_text(file.read_text(encoding="utf-8")[:-5], encoding="utf-8")
    assert store.rows("some monitor", work, tasks) == rows
    assert made == ["a", "b", "b"]
    assert len([json.loads(line) for line in file.read_text(encoding="utf-8").splitlines()]) == 2
    store.rows("some monitor", work, [replace(tasks[0], turned=True)])
    assert made[-1] == "a"
