"""A real rclpy publisher on loopback."""

from __future__ import annotations

import importlib.util
import json
import os
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from tactful import MonitorConfig, Recording, Robot
from tactful.cli._app import main
from tactful.control import CartesianImpedance, Pose
from tactful.dynamics import Dynamics
from tactful.live import Recorder, Session, SourceError, Step, open_source
from tactful.live.sources import Settings
from tactful.simulation import Push, WorkCell
from tests._counterparts import missing

pytestmark = [
    pytest.mark.live,
    pytest.mark.timeout(300),
    pytest.mark.filterwarnings("ignore::DeprecationWarning"),  # rclpy's own
]

PANDA = Robot.load("panda")
CONFIG = MonitorConfig(robot={"model": "panda"}, noise={"velocity_rad_s": 0.001, "torque_nm": 0.05, "model_nm": 0.2})
DOMAIN = 1 + os.getpid() % 100
"""Of this run alone, so that another on the same machine does not join in."""
FINGERS = ["panda_finger_joint1", "panda_finger_joint2"]


@pytest.fixture(autouse=True)
def _client(monkeypatch: pytest.MonkeyPatch) -> None:
    for package in ("rclpy", "sensor_msgs"):
        if importlib.util.find_spec(package) is None:
            missing(f"{package} is not installed")
    monkeypatch.setenv("ROS_DOMAIN_ID", str(DOMAIN))
    monkeypatch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")


@pytest.fixture(scope="module")
def pushed() -> Recording:
    """An arm at rest that a hand pushes."""
    home = Pose(*Dynamics(PANDA).pose(PANDA.home))
    cell = WorkCell(PANDA, hands=[Push(link="panda_link7", force_n=(0, 15, 0), start_s=1.2, hold_s=0.3)])
    for _ in cell.run(CartesianImpedance(PANDA), lambda t: home, 2.5):
        pass
    return cell.recording()


class Arm:
    """A driver: it publishes joint states, in step with whoever listens once `start` was called."""

    def __init__(self, *, names: list[str] | None = None, efforts: bool = True) -> None:
        import rclpy
        from sensor_msgs.msg import JointState
        from std_msgs.msg import String

        self.context = rclpy.Context()
        rclpy.init(context=self.context)
        self.node = rclpy.create_node("driver", context=self.context)
        self.publisher = self.node.create_publisher(JointState, "/joint_states", 50)
        self.heard: list[str] = []
        self.node.create_subscription(String, "/tactful/events", lambda message: self.heard.append(message.data), 100)
        self.message = JointState()
        self.names = [*FINGERS, *reversed(PANDA.joint_names)] if names is None else names  # any order, and others too
        self.message.name = self.names
        self.efforts = efforts
        self.t = 0.0
        self.still = threading.Event()
        self.thread: threading.Thread | None = None

    def send(self, t: float, q: Any, dq: Any, tau: Any) -> None:
        """Publish a state."""
        stamp = self.message.header.stamp
        stamp.sec, stamp.nanosec = 1000 + int(t), round(1e9 * (t % 1))
        for name, values in (("position", q), ("velocity", dq), ("effort", tau)):
            setattr(self.message, name, [0.0, 0.0, *np.asarray(values)[::-1].tolist()][-len(self.names) :])
        if not self.efforts:
            self.message.effort = []
        self.publisher.publish(self.message)

    def idle(self) -> None:
        """Publish an arm at rest at 1 kHz in the background, until `start`."""
        tau = Dynamics(PANDA).gravity(PANDA.home)

        def publish() -> None:
            while not self.still.wait(0.001):
                self.t += 0.001
                self.send(self.t, PANDA.home, np.zeros(7), tau)

        self.thread = threading.Thread(target=publish)
        self.thread.start()

    def start(self) -> float:
        """Publish nothing by itself any more; return the time so far [s]."""
        self.still.set()
        if self.thread is not None:
            self.thread.join()
        return self.t

    def close(self) -> None:
        """Leave the graph."""
        self.start()
        self.node.destroy_node()
        self.context.try_shutdown()


@pytest.fixture
def arm() -> Iterator[Arm]:
    """A driver that idles."""
    driver = Arm()
    driver.idle()
    yield driver
    driver.close()


def open_session(arm: Arm) -> Session:
    """Connect to the driver."""
    session = Session(open_source("ros2:/joint_states", CONFIG), reconnect_s=0.5)
    session.open()
    assert session.source.rate_hz == pytest.approx(1000.0, rel=0.01)
    return session


def in_step(arm: Arm, session: Session, count: int, row: Callable[[int], Any]) -> Iterator[Step]:
    """Run the session; once it runs, send the next of `count` messages for every one that it took."""
    steps = session.steps()
    step = next(steps)
    yield step
    begin = arm.start()
    for k in range(count):
        arm.send(begin + 0.001 * (k + 1), *row(k))
        step = next(steps)
        yield step
    last = 1000 + begin + 0.001 * count
    while step.sample.t < last - 5e-4:  # a few from before may have been on their way
        step = next(steps)
        yield step
    steps.close()


def test_a_minute_of_messages_is_processed(arm: Arm) -> None:
    """60 s of the robot's time: every message once through the monitor, none skipped, whatever the order of joints."""
    session = open_session(arm)
    tau = Dynamics(PANDA).gravity(PANDA.home)
    stamps = [step.sample.t for step in in_step(arm, session, 60_000, lambda k: (PANDA.home, np.zeros(7), tau))]
    report = session.report
    assert report.samples == report.health.samples == len(stamps) >= 60_001
    np.testing.assert_allclose(np.diff(stamps), 0.001, atol=1e-6)
    assert (report.lost, report.contacts, report.degraded) == (0, 0, False)


def test_push_is_told_in_its_sample_and_published(arm: Arm, pushed: Recording, tmp_path: Path) -> None:
    """The event comes with its message, and goes back into the graph."""
    from rclpy.executors import SingleThreadedExecutor

    path = tmp_path / "push.parquet"
    session = open_session(arm)
    recorder = Recorder(path)
    session.on_feed.append(lambda feed: recorder.follow(feed, {}))
    told = []
    names = ("q", "dq", "tau")
    for step in in_step(arm, session, len(pushed), lambda k: [pushed.channels[name][k] for name in names]):
        if step.event is not None:
            told.append((step.sample.t, step.event))
            session.source.tell(step.event)
    executor = SingleThreadedExecutor(context=arm.context)
    executor.add_node(arm.node)
    for _ in range(100):
        executor.spin_once(timeout_sec=0.1)
        if len(arm.heard) == len(told):
            break
    recorder.close()
    assert told
    t, first = told[0]
    assert (first.phase, first.detected_s) == ("began", t)
    assert 1000 + arm.t + 1.2 < t < 1000 + arm.t + 1.4
    assert [json.loads(text) for text in arm.heard] == [event.to_dict() for _, event in told]
    recording = Recording.read(path)
    count = len(pushed)  # a message from before may come first
    np.testing.assert_array_equal(recording.channels["tau"][-count:], pushed.channels["tau"])


def test_silent_topic_ends_the_run(arm: Arm, tmp_path: Path) -> None:
    """The driver dies: one line, exit code 1, the recording kept."""
    path = tmp_path / "cut.parquet"
    source = open_source("ros2:/joint_states", CONFIG)
    session = Session(source, reconnect_s=0.2)
    recorder = Recorder(path)
    session.on_feed.append(lambda feed: recorder.follow(feed, {}))
    session.open()
    for k, _ in enumerate(session.steps()):
        if k == 300:
            arm.start()
    recorder.close()
    report = session.report
    assert report.problem is not None
    assert "/joint_states has been silent for 1 s; not found again in 0.2 s" in report.problem
    assert len(Recording.read(path)) == report.samples >= 301


def test_wrong_topic_names_those_that_there_are(arm: Arm, capsys: pytest.CaptureFixture[str]) -> None:
    """A wrong name is told with the right ones, in one line."""
    assert main(["live", "--source", "ros2:/joints", "--robot", "panda"]) == 2
    said = capsys.readouterr().err.strip()
    assert "nobody publishes on /joints: joint states are on /joint_states" in said
    assert len(said.splitlines()) == 1


def test_another_arm_is_told(arm: Arm, capsys: pytest.CaptureFixture[str]) -> None:
    """The joints of a UR are not those of a Panda."""
    assert main(["live", "--source", "ros2:/joint_states", "--robot", "ur5e"]) == 2
    assert (
        "/joint_states has no joint shoulder_pan_joint of ur5e: it has panda_finger_joint1" in capsys.readouterr().err
    )


def test_states_without_effort_are_told(capsys: pytest.CaptureFixture[str]) -> None:
    """Many drivers leave the effort out; without it there is nothing to monitor."""
    driver = Arm(efforts=False)
    driver.idle()
    try:
        assert main(["live", "--source", "ros2:/joint_states", "--robot", "panda"]) == 2
    finally:
        driver.close()
    assert "9 positions, 9 velocities and 0 efforts for 9 joints: all three are needed" in capsys.readouterr().err


def test_state_of_a_franka_is_understood() -> None:
    """franka_msgs/FrankaRobotState holds the joint state as a field; the package is not on every machine."""
    source: Any = open_source("ros2:/franka_robot_state_broadcaster/robot_state", CONFIG)
    state = SimpleNamespace(name=list(PANDA.joint_names), position=[1.0] * 7, velocity=[2.0] * 7, effort=[3.0] * 7)
    stamp = SimpleNamespace(sec=5, nanosec=500_000_000)
    message = SimpleNamespace(header=SimpleNamespace(stamp=stamp), measured_joint_state=state)
    sample = source._sample(message, 0)
    assert (sample.t, sample.q, sample.dq, sample.tau) == (5.5, (1.0,) * 7, (2.0,) * 7, (3.0,) * 7)
    assert Settings(config=CONFIG).react is False
    assert os.environ["ROS_DOMAIN_ID"] == str(DOMAIN)


@pytest.mark.parametrize("address", ["ros2:", "ros2:joint_states", "ros2:/"])
def test_address_without_topic_is_told(address: str) -> None:
    """A topic begins with a slash."""
    with pytest.raises(SourceError, match="no topic is named"):
        open_source(address, CONFIG)
