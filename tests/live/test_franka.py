"""The real libfranka client against a simulated arm that speaks its protocol on loopback."""

from __future__ import annotations

import importlib.util
import os
import socket
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import AbstractContextManager, ExitStack
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tactful import MonitorConfig, Recording, Robot
from tactful.cli._app import main
from tactful.control import MinimumJerkPath, Pose
from tactful.dynamics import Dynamics
from tactful.live import Recorder, Session, SourceError, Step, open_source
from tactful.reaction import load_policy
from tests._counterparts import missing
from tests.live import _served as served
from tests.live._scenes import Scene
from tests.live._served import Served

pytestmark = [pytest.mark.live, pytest.mark.timeout(300)]

CONFIG = MonitorConfig(noise={"velocity_rad_s": 0.001, "torque_nm": 0.05, "model_nm": 0.2})
FR3 = Robot.load("fr3")


@pytest.fixture(autouse=True)
def _client() -> None:
    for package in ("pylibfranka", "franky_sim"):
        if importlib.util.find_spec(package) is None:
            missing(f"{package} is not installed")


def serve(scene: Scene, host: str | None = None) -> AbstractContextManager[Served]:
    """Serve an arm that speaks libfranka's protocol."""
    return served.serve("_franka_server", scene, host)


def in_step(arm: Served, session: Session, duration_s: float) -> Iterator[Step]:
    """Run the session; the arm sends a state for every one that was taken."""
    arm.get_in_step()
    session.source.begin()  # takes what has been sent so far
    arm.grant()
    for step in session.steps(duration_s):
        arm.grant()
        yield step


def plan() -> MinimumJerkPath:
    """Move the tip 0.3 m along y in two seconds."""
    start = Pose(*Dynamics(FR3).pose(FR3.home))
    there = Pose(start.rotation, start.position_m + np.array([0.0, 0.3, 0.0]))
    return MinimumJerkPath([(0.8, start), (2.8, there)])


def test_a_minute_of_states_is_processed() -> None:
    """60 s of the robot's time at 1 kHz: every state once through the monitor, none skipped, nothing seen in noise."""
    with serve(Scene()) as arm:
        session = Session(open_source(f"franka://{arm.host}", CONFIG))
        session.open()
        stamps = [step.sample.t for step in in_step(arm, session, 60.0)]
        report = session.report
    assert report.samples == report.health.samples == len(stamps) == 60_001
    np.testing.assert_allclose(np.diff(stamps), 0.001, atol=1e-9)
    assert (report.lost, report.contacts, report.degraded) == (0, 0, False)


def test_push_is_told_in_its_sample(tmp_path: Path) -> None:
    """A hand on an arm that is only listened to: the event comes with the state in which the detector fires."""
    path = tmp_path / "push.parquet"
    with serve(Scene(hand_s=1.2)) as arm:
        session = Session(open_source(f"franka://{arm.host}", CONFIG))
        recorder = Recorder(path)
        session.on_feed.append(lambda feed: recorder.follow(feed, {}))
        session.open()
        told = []
        for step in in_step(arm, session, 2.5):
            if step.event is not None:
                told.append((step.sample.t, step.event))
        recorder.close()
    assert told
    t, first = told[0]
    assert first.phase == "began"
    assert first.detected_s == t
    assert arm.truth is not None
    (contact,) = arm.truth["contacts"]
    assert contact["kind"] == "cooperation"
    assert max(event.peak_force_n for _, event in told) > 8.0
    assert len(Recording.read(path)) == session.report.samples


@pytest.fixture(scope="module")
def unreacted() -> dict[str, Any]:
    """What the collision is like when nothing is done about it."""
    return collide("continue")[0]


def collide(policy: str) -> tuple[dict[str, Any], list[str]]:
    """Run the tip into a post, and return the truth and what the arm did in turn."""
    did: list[str] = []
    with serve(Scene(obstacle=True)) as arm:
        source = open_source(f"franka://{arm.host}", CONFIG, react=True)
        session = Session(source, policy=load_policy(policy), plan=plan().pose)
        session.open()
        for step in session.steps(4.0):
            if not did or did[-1] != step.reaction:
                did.append(step.reaction)
        report = session.report
    assert report.problem is None
    assert arm.truth is not None
    assert report.lost <= arm.truth["unasked"]  # before the first torque, the server does not wait
    assert arm.truth["commands"] >= report.samples
    return arm.truth, did


@pytest.mark.parametrize("policy", ["stop", "retract", "comply"])
def test_reaction_over_the_protocol(policy: str, unreacted: dict[str, Any]) -> None:
    """Torques over the wire: after a collision the peak force is lower, and a retreat ends the contact soon."""

    def figures(truth: dict[str, Any]) -> tuple[float, float]:
        contacts = [contact for contact in truth["contacts"] if contact["kind"] == "collision"]
        return max(c["peak_force_n"] for c in contacts), sum(c["end_s"] - c["touch_s"] for c in contacts)

    truth, did = collide(policy)
    assert policy in did
    peak, time_s = figures(truth)
    peak_without, time_without_s = figures(unreacted)
    assert peak < peak_without
    if policy == "retract":
        assert time_s < 0.25 * time_without_s
    assert truth["speed"] < 0.02


def test_connection_lost_in_motion(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The line breaks while the arm moves: one line, exit code 1, the recording kept, the arm at rest."""
    path = tmp_path / "cut.parquet"
    with serve(Scene()) as arm:
        arm.switch_off_once_recorded(path, 1000 * 22 * 8)  # of which the settings are a part
        words = ["live", "--source", f"franka://{arm.host}", "--react", "stop", "--record", str(path)]
        assert main(words) == 1
    said = capsys.readouterr().err
    (line,) = [line for line in said.splitlines() if "before its time" in line]
    assert "the arm stopped, or its connection is lost" in line
    assert len(Recording.read(path)) >= 500
    assert arm.truth is not None
    assert arm.truth["speed"] < 0.02


def test_lost_arm_is_found_again() -> None:
    """An arm that is listened to may be restarted: its clock begins anew, the run goes on."""
    stamps: list[float] = []
    with serve(Scene()) as first:
        session = Session(open_source(f"franka://{first.host}", CONFIG), reconnect_s=60.0)
        session.open()
        arms = [first]
        with ExitStack() as stack:

            def come_back() -> None:
                first.process.wait()
                arms.append(stack.enter_context(serve(Scene(), first.host)))

            thread = threading.Thread(target=come_back)
            thread.start()
            first.grant()
            again = 0
            for step in session.steps():
                stamps.append(step.sample.t)
                arms[-1].grant()
                if len(stamps) == 700:
                    first.switch_off()
                again += session.report.reconnects
                if again == 800:
                    break
            thread.join()
    report = session.report
    assert report.reconnects == 1
    assert np.diff(stamps).min() > 0
    assert report.degraded
    assert len(stamps) >= 1500


def test_priority_is_not_inherited() -> None:
    """Libfranka gives the loop the highest real-time priority: threads and programs that it starts go without it."""
    with serve(Scene()) as arm:
        source = open_source(f"franka://{arm.host}", CONFIG)
        source.open()
        found: list[int] = []
        thread = threading.Thread(target=lambda: found.append(os.sched_getscheduler(0)))
        thread.start()
        thread.join()
        asks = [sys.executable, "-c", "import os; print(os.sched_getscheduler(0))"]
        found.append(int(subprocess.run(asks, capture_output=True, text=True, check=True).stdout))
        source.close()
    assert found == [os.SCHED_OTHER, os.SCHED_OTHER]


def test_nobody_there_is_told_in_one_line(capsys: pytest.CaptureFixture[str]) -> None:
    """A wrong address is the commonest mistake."""
    host = served.address()
    assert main(["live", "--source", f"franka://{host}"]) == 2
    (line,) = capsys.readouterr().err.strip().splitlines()
    assert f"no arm at {host}, port 1337: Connection refused; check the address and that FCI is active" in line
    assert main(["live", "--source", "franka://no-such-host.invalid"]) == 2


def test_another_arm_is_told(capsys: pytest.CaptureFixture[str]) -> None:
    """Seven joints cannot be an arm of six, and Franka's interface is no KUKA's."""
    with pytest.raises(SourceError, match="gives 7 joints, but ur5e has 6"):
        open_source("franka://127.0.0.1", MonitorConfig(robot={"model": "ur5e"}))
    with pytest.raises(SourceError, match=r"is an arm of Franka, not .* iiwa.*: choose fr3 or panda"):
        open_source("franka://127.0.0.1", MonitorConfig(robot={"model": "iiwa14"}))


def test_port_in_use_is_told() -> None:
    """An arm that has a client already hangs up on the next: that one is told, in one line."""
    host = served.address()
    with socket.create_server((host, 1337)) as server:
        server.settimeout(30.0)

        def hang_up() -> None:
            for _ in range(2):  # the knock, and the client itself
                server.accept()[0].close()

        thread = threading.Thread(target=hang_up)
        thread.start()
        words = [sys.executable, "-m", "tactful", "live", "--source", f"franka://{host}"]
        done = subprocess.run(words, capture_output=True, text=True, timeout=60)
        thread.join()
    assert done.returncode == 2
    assert len(done.stderr.strip().splitlines()) == 1
    assert "cannot be used" in done.stderr
