"""Episodes: what a spec names is what happens, the same every time, and its labels are the truth."""

import json
import os
import signal
import subprocess
import sys
import textwrap
import time
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tactful.config import ConfigError
from tactful.control import FOLLOW_STEP_S, CartesianImpedance, ImpedanceConfig, Pose, follow
from tactful.dynamics import Dynamics
from tactful.errors import TactfulError
from tactful.evaluation import check_labels, find_recordings
from tactful.monitor import MonitorConfig
from tactful.recordings import Recording
from tactful.simulation import (
    KINDS,
    OPERATORS,
    PLACES,
    Demonstration,
    EpisodeKind,
    EpisodeSpec,
    SensorConfig,
    WorkCell,
    draw_plan,
    generate,
    peg_arm,
    read_manifest,
    run_episode,
    simulate,
    spec_of,
)
from tactful.simulation._operators import Operator
from tactful.simulation._shape import Shape

QUICK = EpisodeSpec(kind="free", seed=3, speed_m_s=0.4)


def spec(kind: EpisodeKind, trajectory: Any, **changes: Any) -> EpisodeSpec:
    """Return a quick episode."""
    helped = {"operator": "brisk", "place": "panda_link5"} if "cooperation" in kind else {}
    return EpisodeSpec(kind=kind, trajectory=trajectory, seed=11, speed_m_s=0.22, **(helped | changes))


@pytest.mark.parametrize(
    ("kind", "trajectory", "sensors"),
    [
        ("free", "free", "clean"),
        ("cooperation", "free", "panda"),
        ("collision_then_cooperation", "top", "clean"),
        ("cooperation_then_collision", "side", "clean"),
        ("collision", "obstacle", "panda"),
    ],
)
def test_kind_is_what_happens(kind: EpisodeKind, trajectory: str, sensors: str) -> None:
    """A set is balanced by what its specs say, so each has to give the contacts that it names, in their order."""
    wanted = spec(kind, trajectory, sensors=sensors)
    result = run_episode(wanted)
    labels = result.recording.labels
    check_labels(result.recording, links=7)
    assert spec_of(result.recording) == wanted
    kinds = [label.kind for label in labels]
    if kind == "free":
        assert result.contacts == ()
    elif "_then_" in kind:
        first, second = kind.split("_then_")
        assert kinds[0] == first
        assert second in kinds
    else:
        assert set(kinds) == {kind}
    assert all(label.visible_s is not None and label.peak_force_n >= 1 for label in labels)
    for label in labels:
        assert label.start_s <= label.visible_s <= label.end_s
        if label.kind == "cooperation":
            assert label.link == 4
    if trajectory == "obstacle":
        assert result.contacts[0].name == "bar"


def test_arm_is_not_led_into_its_own_stops() -> None:
    """A stop that pushes back is a contact that no label tells: such an attempt is drawn again."""
    led = EpisodeSpec(kind="cooperation", seed=13782585983535, approach="axis", operator="abrupt", place="panda_link6")
    q, robot = simulate(led).q, peg_arm()
    assert q is not None
    assert (q >= robot.lower).all()
    assert (q <= robot.upper).all()


def test_same_spec_is_the_same_recording() -> None:
    """What cannot be made again cannot be examined; sensors must not decide what the arm does, but what is seen."""
    first, second = simulate(QUICK), simulate(QUICK)
    for name in ("q", "dq", "tau"):
        np.testing.assert_array_equal(first.channels[name], second.channels[name])
    other = simulate(QUICK.model_copy(update={"seed": 4}))
    assert len(other) != len(first) or np.any(other.q != first.q)


def test_visible_onset_is_where_the_force_passes_one_newton() -> None:
    """Latencies are told from that moment, so it has to be that of the torque that the contact really makes."""
    arm = peg_arm()
    hand = OPERATORS["calm"].hand(
        "panda_link7", np.zeros(3), np.zeros(3), np.array([1.0, 0, 0]), 0.1, np.random.default_rng(1)
    )
    cell = WorkCell(arm, hands=[hand], sensors=SensorConfig.exact())
    dynamics, force, t = Dynamics(arm), [], []
    for _ in range(500):
        q = cell.q
        t.append(cell.step(np.zeros(7)).t)
        torque = cell.tau_ext
        J = dynamics.jacobian_at(q, 6, Shape(arm).link_pose(q, 6)[1])
        force.append(np.linalg.norm(np.linalg.lstsq(J[:3].T, torque, rcond=None)[0]))
    (contact,) = cell.contacts
    assert contact.visible_s == pytest.approx(t[int(np.argmax(np.array(force) >= 1.0))], abs=1e-9)
    assert contact.touch_s == pytest.approx(t[int(np.argmax(np.array(force) > 1e-9))], abs=2e-3)


def test_good_demonstration_inserts_the_peg() -> None:
    """Without a way that works, nothing in the cell says anything about the task; one that leads astray must fail."""
    assert run_episode(spec("collision", "ideal")).inserted
    failed = run_episode(spec("collision", "side"))
    assert not failed.inserted
    assert failed.contacts[0].name == "box"


def test_elastic_joints_change_little_of_a_slow_motion() -> None:
    """The option must be the same arm with softer joints: alike where nothing shakes it."""
    rigid = simulate(QUICK.model_copy(update={"sensors": "exact"}))
    elastic = simulate(QUICK.model_copy(update={"sensors": "exact", "elastic": True}))
    difference = np.abs(rigid.q - elastic.q).max()
    assert 1e-6 < difference < 0.01
    assert np.abs(rigid.tau - elastic.tau).mean() < 0.2


def test_follower_foresees_the_motion() -> None:
    """Bars are put where a link will be: the foresight without inertia has to be near to the simulation."""
    arm = peg_arm()
    rotation, start = Dynamics(arm).pose(arm.home)
    path = Demonstration([start, start + np.array([0.1, 0.2, -0.1])], [0.15], [rotation] * 2, np.random.default_rng(0))
    track = follow(arm, path.pose, arm.home, path.end_s, ImpedanceConfig())
    cell, controller = WorkCell(arm, sensors=SensorConfig.exact()), CartesianImpedance(arm)
    q = np.array([sample.q for sample in cell.run(controller, path.pose, path.end_s)])
    assert np.abs(q[:: round(1000 * FOLLOW_STEP_S)] - track[: len(q[:: round(1000 * FOLLOW_STEP_S)])]).max() < 0.12


def test_plan_is_balanced_and_has_no_twins() -> None:
    """A class, an operator or a place that comes more often than another would be learnt instead of the contact."""
    plan = draw_plan(300, 5, sensors="panda")
    assert Counter(item.kind for item in plan) == dict.fromkeys(KINDS, 60)
    for field, values in (("operator", OPERATORS), ("place", PLACES)):
        counts = Counter(getattr(item, field) for item in plan if "cooperation" in item.kind)
        assert set(counts) == set(values)
        assert max(counts.values()) - min(counts.values()) <= 3
    assert {item.trajectory for item in plan if item.kind == "collision"} == {
        "ideal",
        "border",
        "top",
        "side",
        "obstacle",
    }
    assert len({item.name for item in plan + draw_plan(300, 6, sensors="panda")}) == 600
    assert draw_plan(10, 5, sensors="panda") == plan[:10]
    held_out = draw_plan(40, 1, operators=("shaky",), kinds=("cooperation", "free"))
    assert {item.operator for item in held_out} == {"shaky", None}


def test_set_is_complete_and_made_once(tmp_path: Path) -> None:
    """A set of an hour must not begin anew after a break, and a monitor has to be able to read it as it is."""
    plan = [QUICK, QUICK.model_copy(update={"seed": 5})]
    seen: list[str] = []
    entries = generate(plan, tmp_path, jobs=1, on_done=lambda entry: seen.append(entry.file))
    assert [entry.spec for entry in entries] == plan
    assert {path.name for path in find_recordings([tmp_path])} == set(seen)
    recording = Recording.read(tmp_path / entries[0].file)
    assert spec_of(recording) == QUICK
    np.testing.assert_array_equal(recording.tau, simulate(QUICK).tau)
    assert MonitorConfig.load(tmp_path / "monitor.toml").robot.payload_kg == 0.4
    before = (tmp_path / entries[0].file).stat().st_mtime_ns
    (tmp_path / entries[1].file).unlink()
    with (tmp_path / "manifest.jsonl").open("a") as manifest:
        manifest.write('{"file": "torn')
    assert generate(plan, tmp_path, jobs=1) == entries
    assert (tmp_path / entries[0].file).stat().st_mtime_ns == before
    assert len(read_manifest(tmp_path)) == 2


@pytest.mark.skipif(os.name == "nt", reason="SIGKILL")
def test_killed_run_is_taken_up(tmp_path: Path) -> None:
    """A machine that goes down leaves whole recordings and nothing else that counts."""
    script = textwrap.dedent(
        f"""
        from tactful.simulation import draw_plan, generate
        generate(draw_plan(50, 1, kinds=("free",)), {str(tmp_path)!r}, jobs=1)
        """
    )
    process = subprocess.Popen([sys.executable, "-c", script])
    deadline = time.monotonic() + 90
    while not list(tmp_path.glob("[!.]*.parquet")) and time.monotonic() < deadline:
        time.sleep(0.05)
    process.send_signal(signal.SIGKILL)
    process.wait()
    done = list(tmp_path.glob("[!.]*.parquet"))
    assert done
    for path in done:
        assert Recording.read(path).labels == ()
    plan = draw_plan(len(done), 1, kinds=("free",))
    assert len(generate(plan, tmp_path, jobs=1)) == len(done)
    assert not list(tmp_path.glob(".free*"))


def test_manifest_that_is_broken_is_told(tmp_path: Path) -> None:
    """A line that cannot be read must not lose the others silently."""
    with pytest.raises(TactfulError, match="cannot be read"):
        read_manifest(tmp_path)
    (tmp_path / "manifest.jsonl").write_text('{"file": 3}\n{"file": 4}\n')
    with pytest.raises(TactfulError, match="line 1: is not an episode"):
        read_manifest(tmp_path)


def test_mistakes_are_told() -> None:
    """A misspelt operator would otherwise be found after an hour of simulation."""
    with pytest.raises(ConfigError, match="did you mean 'operator'"):
        EpisodeSpec(kind="free", seed=1, operater="brisk")  # type: ignore[call-arg]
    with pytest.raises(TactfulError, match="no operator 'Brisk': choose from brisk"):
        draw_plan(3, 1, operators=("Brisk",))
    with pytest.raises(TactfulError, match="n = 0"):
        draw_plan(0, 1)
    with pytest.raises(TactfulError, match="place None"):
        simulate(EpisodeSpec(kind="cooperation", seed=1, operator="brisk"))
    with pytest.raises(TactfulError, match="no episode was asked for"):
        generate([], "nowhere")
    with pytest.raises(TactfulError, match="jobs is 0"):
        generate([QUICK], "nowhere", jobs=0)
    with pytest.raises(TactfulError, match="no sensors 'noisy': choose from exact, clean, panda"):
        SensorConfig.preset("noisy")


def test_operators_push_as_they_are_described() -> None:
    """Their styles are what makes rates differ between people: force, rise and direction have to be as stated."""
    rng = np.random.default_rng(2)
    up = np.array([0.0, 0.0, 1.0])
    for operator in OPERATORS.values():
        _check_operator(operator, up, rng)
    assert {operator.experienced for operator in OPERATORS.values()} == {True, False}


def _check_operator(operator: Operator, up: np.ndarray, rng: np.random.Generator) -> None:
    angles = [np.arccos(operator.direction(up, rng)[2]) for _ in range(400)]
    assert np.sqrt(np.mean(np.square(angles))) == pytest.approx(operator.astray_rad, rel=0.2)
    along = [operator.across(np.array([1.0, 0, 0]), up, rng) for _ in range(400)]
    np.testing.assert_allclose(np.linalg.norm(along, axis=1), 1.0)
    assert np.arcsin(np.min(along, axis=0)[0]) > operator.along[0] - 1e-9
    hand = operator.hand("panda_link5", np.zeros(3), np.zeros(3), up, 1.0, rng)
    t = np.arange(0.9, hand.end_s + 0.1, 0.001)
    force = np.array([hand.force(x, np.zeros(3), np.zeros(3)) for x in t])
    acting = np.array([hand.acts(x) for x in t])
    assert not force[~acting].any()
    strength = np.linalg.norm(force, axis=1).max()
    assert 0.5 * operator.force_n[0] < strength < operator.force_n[1] + 3 * operator.tremor_n


def test_demonstration_is_smooth_and_goes_where_it_should() -> None:
    """A reference with a jump would make the arm jerk, and look like a contact."""
    points = np.array([[0.0, 0, 0], [0.2, 0, 0], [0.2, 0.2, -0.1]])
    path = Demonstration(points, [0.2, 0.1], [np.eye(3)] * 2, np.random.default_rng(0), wobble_m=0.002)
    positions = path.points_m
    np.testing.assert_allclose(positions[[0, -1]], points[[0, -1]], atol=1e-12)
    velocity = np.diff(positions, axis=0) / 0.001
    assert np.linalg.norm(velocity, axis=1).max() < 2.2 * 0.2
    assert np.abs(np.diff(velocity, axis=0) / 0.001).max() < 3
    pose: Pose = path.pose(100.0)
    np.testing.assert_array_equal(pose.position_m, positions[-1])
    with pytest.raises(TactfulError, match="positive"):
        Demonstration(points, [0.2, 0.0], [np.eye(3)] * 2, np.random.default_rng(0))
    with pytest.raises(TactfulError, match="2 points"):
        Demonstration(points[:1], [], [np.eye(3)] * 2, np.random.default_rng(0))


def test_spec_survives_json() -> None:
    """A manifest is read by others and later: nothing of a spec may be lost on the way."""
    wanted = spec("cooperation", "free", payload_error_kg=0.1, impedance=ImpedanceConfig(stiffness_n_m=300.0))
    again = EpisodeSpec(**json.loads(wanted.model_dump_json()))
    assert again == wanted
    assert again.name == wanted.name
