"""What the page is told and what it says, without a browser."""

from __future__ import annotations

import multiprocessing
import socket
import threading
from pathlib import Path

import numpy as np
import pytest

from tactful import MonitorConfig, Robot
from tactful.errors import TactfulError
from tactful.live import Session
from tactful.live.sources import Settings
from tactful.live.sources.sim import SimSource
from tactful.live.view._contacts import _strip
from tactful.live.view._controls import scaled
from tactful.live.view._history import History
from tactful.live.view._meshes import link_poses, surfaces
from tactful.live.view._messages import Frame, Setup, Wish, thin
from tactful.live.view._view import _Follower, _free, level_thresholds
from tactful.live.view._words import calibration, evidence_card, headline, reason
from tactful.monitor import ContactEvent

CONFIG = MonitorConfig(robot={"model": "panda"})


def event(**other: object) -> ContactEvent:
    """A person has helped."""
    told = {
        "id": 3,
        "phase": "ended",
        "kind": "cooperation",
        "onset_s": 12.0,
        "detected_s": 12.05,
        "end_s": 12.5,
        "link": "panda_link7",
        "directions": ("y",),
        "force_n": (0.0, 12.0, 0.0),
        "peak_force_n": 14.2,
        "torque_ext_nm": (),
        "velocity_m_s": (0.0, 0.2, 0.0),
        "confidence": 0.97,
        "evidence": (),
        "sigma_min": 0.2,
        "damped": False,
    }
    return ContactEvent(**told | other)  # type: ignore[arg-type]


def test_thinning_keeps_every_peak() -> None:
    """A level that is above its threshold for one sample must be seen in the plot."""
    dtype = np.dtype([("t", "f8"), ("level", "f8", 3), ("wrench", "f8", 6), ("tau_ext", "f8", 7), ("state", "i8")])
    rows = np.zeros(1000, dtype)
    rows["t"] = 5.0 + 0.001 * np.arange(1000)
    rows["level"][537, 1] = 4.0
    trace, index = thin(rows, np.array([1.0, 2.0, 1.0]))
    assert 49 <= len(trace.t) <= 51
    assert 537 in index
    assert trace.level.max() == 2.0
    assert len(thin(rows[:0], np.ones(3))[0].t) == 0


def test_history_gives_a_window_and_forgets() -> None:
    """The page runs for hours: what it keeps is bounded, and the newest is always there."""
    dtype = np.dtype([("t", "f8"), ("level", "f8", 3), ("wrench", "f8", 6), ("tau_ext", "f8", 7), ("state", "i8")])
    history = History()
    for k in range(4000):
        rows = np.zeros(2, dtype)
        rows["t"] = 0.1 * k + np.array([0.0, 0.05])
        history.add(thin(rows, np.ones(3))[0])
    window = history.window(398.0, 400.0)
    assert window is not None
    assert (window.t[0], window.t[-1]) == pytest.approx((398.0, 399.95))
    assert sum(len(part.t) for part in history._parts) < 4000
    assert history.window(0.0, 10.0) is None


def test_words_say_what_decided_and_escape_what_files_say() -> None:
    """Names come from files of others: none of them may become a part of the page."""
    assert reason(event()) == "cooperation: force along +y with the motion, p = 0.97"
    assert reason(event(kind="collision", force_n=(1.0, -9.0, 0.0))).startswith("collision: force along -y against the")
    assert reason(event(force_n=(8.0, 0.0, 0.0), velocity_m_s=None)).startswith("cooperation: force along +x at rest")
    assert reason(event(kind="contact")) == "contact: force along +y, not classified yet"
    assert headline(event()) == "12.00 s  ·  cooperation  ·  14 N  ·  panda_link7"
    assert "detected 50 ms later" in evidence_card(event())
    assert "<script>" not in _strip([event(link="<script>alert(1)</script>")], 0.0, 30.0, 13.0, None)


def test_rate_of_false_alarms_is_stated_or_not_known() -> None:
    """A slider that promised a rate nobody measured would mislead."""
    assert "not calibrated" in calibration(CONFIG, 1.0)
    known = CONFIG.model_copy(update={"provenance": {"false_alarms_per_hour": 0.125, "threshold": "supported"}})
    assert calibration(known, 1.0) == "Calibrated for 0.125 false alarms per hour: supported."
    assert "fewer than 0.125" in calibration(known, 1.5)
    assert "more than 0.125" in calibration(known, 0.5)


def test_scaled_thresholds_reach_a_running_monitor() -> None:
    """The factor has to be in force from the next sample on, in both modes, and back at 1 all is as it was."""
    from tactful import Monitor

    for mode, path in (("fast", ("glr", "threshold")), ("paper", ("contact", "threshold"))):
        config = CONFIG.model_copy(update={"mode": mode})
        monitor = Monitor(config=config)
        before = monitor._memory.record[path[0]][path[1]][0].copy()
        monitor.retune(scaled(config, 2.0))
        np.testing.assert_array_equal(monitor._memory.record[path[0]][path[1]][0], 2 * before)
        monitor.retune(scaled(config, 1.0))
        np.testing.assert_array_equal(monitor._memory.record[path[0]][path[1]][0], before)
    with pytest.raises(TactfulError, match="only thresholds"):
        monitor.retune(config.model_copy(update={"mode": "fast"}))
    assert level_thresholds(config).shape == (3,)


def test_port_in_use_is_one_line() -> None:
    """The usual mistake: another page runs already."""
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        with pytest.raises(TactfulError, match=r"port \d+: .* choose another --port"):
            _free(taken.getsockname()[1])
    assert _free(0) > 0
    with pytest.raises(TactfulError, match="port 700000"):
        _free(700000)


def test_meshes_of_a_file_lie_where_its_capsules_would(tmp_path: Path) -> None:
    """Vertices are taken from the file's world into the frame of each link: a cube about a joint must stay there."""
    pytest.importorskip("mujoco")
    (tmp_path / "arm.xml").write_text(
        """<mujoco><asset><mesh name="cube" vertex="0 0 0  1 0 0  0 1 0  0 0 1" scale="0.1 0.1 0.1"/></asset><worldbody>
        <body name="base" pos="1 2 3"><body name="upper" pos="0 0 0.2" euler="0 0 90"><joint name="one" axis="0 0 1"/>
        <inertial mass="1" pos="0 0 0" diaginertia="0.1 0.1 0.1"/><geom type="mesh" mesh="cube"/>
        <body name="lower" pos="0.5 0 0"><joint name="two" axis="0 1 0"/><inertial mass="1" pos="0 0 0"
        diaginertia="0.1 0.1 0.1"/><geom type="mesh" mesh="cube" pos="0.1 0 0"/><site name="tip" pos="0.2 0 0"/></body>
        </body></body></worldbody></mujoco>"""
    )
    robot = Robot.load(tmp_path / "arm.xml", tip="tip")
    found = surfaces(robot, str(tmp_path / "arm.xml"))
    assert sorted(found) == [0, 1]
    corner = found[1].vertices[np.argmin(np.linalg.norm(found[1].vertices - [0.1, 0, 0], axis=1))]
    np.testing.assert_allclose(corner, [0.1, 0.0, 0.0], atol=1e-6)
    assert len(link_poses(robot, robot.home)) == 2


@pytest.mark.timeout(600)  # the kernels may have to be compiled
def test_loop_does_not_wait_for_a_page_that_hangs() -> None:
    """Nobody reads the other end of the pipe: the loop goes on, and a wish that came before is fulfilled."""
    ours, theirs = multiprocessing.Pipe()
    source = SimSource("sim", Settings(config=CONFIG, react=True, speed=0), alone=False)
    session = Session(source)
    session.open()
    follower = _Follower(ours, session, "teach")
    assert isinstance(theirs.recv(), Setup)
    theirs.send(Wish("put", (source.shop.in_the_way_m,)))
    report = session.run(0.5)
    assert report.samples > 500
    theirs.close()  # lets a full pipe go
    assert not follower.finish()
    assert source.obstacle_m[0] < source.shop.aside_m[0]


@pytest.mark.timeout(600)
def test_frame_and_restart(tmp_path: Path) -> None:
    """What is sent holds the arm and its signals; `restart` ends the run and is told."""
    ours, theirs = multiprocessing.Pipe()
    source = SimSource("sim", Settings(config=CONFIG, react=True, speed=1.0), alone=False)
    session = Session(source)
    session.open()
    follower = _Follower(ours, session, None)
    theirs.recv()
    theirs.send(Wish("grab", (6, source.shop.plan(0.0).position_m, source.shop.plan(0.0).position_m + 0.1)))
    threading.Timer(2.0, lambda: theirs.send(Wish("restart"))).start()
    session.run(60.0)
    assert follower.finish()
    frames = []
    while theirs.poll():
        frames.append(theirs.recv())
    assert all(isinstance(frame, Frame) for frame in frames)
    assert frames[-1].q is not None
    assert sum(len(frame.trace.t) for frame in frames) > 3
