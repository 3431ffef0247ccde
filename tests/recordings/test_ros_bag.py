"""Bags that ROS 1 and ROS 2 write, made by rosbags: what was measured comes out, in the order of the arm's joints."""

from __future__ import annotations

import sqlite3
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rosbags import rosbag1, rosbag2
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from tactful import Monitor, Robot
from tactful.cli._app import main
from tactful.recordings import Recording, RecordingError
from tests.recordings._make import motion

START_NS = 1_700_000_000_123_456_789
STEP_NS = 1_000_000
PANDA = Robot.load("panda").joint_names
FRANKA = """std_msgs/Header header
sensor_msgs/JointState measured_joint_state
sensor_msgs/JointState tau_ext_hat_filtered
geometry_msgs/WrenchStamped o_f_ext_hat_k
"""
FRANKA_1 = """std_msgs/Header header
float64[7] q
float64[7] dq
float64[7] tau_J
float64[7] tau_ext_hat_filtered
float64[6] O_F_ext_hat_K
"""
STORAGES = ("mcap", "db3", "bag")


class Bag:
    """A bag that is being written: a topic begins with its first message."""

    def __init__(self, path: Path, storage: str) -> None:
        self.store: Any = get_typestore(Stores.ROS1_NOETIC if storage == "bag" else Stores.ROS2_HUMBLE)
        franka, name = (FRANKA_1, "FrankaState") if storage == "bag" else (FRANKA, "FrankaRobotState")
        self.store.register(get_types_from_msg(franka, f"franka_msgs/msg/{name}"))
        self._storage, self._topics = storage, {}
        self._writer: Any = (
            rosbag1.Writer(path)
            if storage == "bag"
            else rosbag2.Writer(
                path,
                version=9,
                storage_plugin=rosbag2.StoragePlugin.MCAP if storage == "mcap" else rosbag2.StoragePlugin.SQLITE3,
            )
        )

    def make(self, kind: str, **fields: Any) -> Any:
        """Make a message."""
        return self.store.types[kind](**fields)

    def header(self, time_ns: int) -> Any:
        """Make a header with a stamp."""
        stamp = self.make("builtin_interfaces/msg/Time", sec=time_ns // 10**9, nanosec=time_ns % 10**9)
        more = {"seq": 0} if self._storage == "bag" else {}
        return self.make("std_msgs/msg/Header", stamp=stamp, frame_id="", **more)

    def joints(self, time_ns: int, names: list[str], q: Any, dq: Any, tau: Any) -> Any:
        """Make joint states."""
        floats = {"position": q, "velocity": dq, "effort": tau}
        arrays = {key: np.array(value, dtype=np.float64) for key, value in floats.items()}
        return self.make("sensor_msgs/msg/JointState", header=self.header(time_ns), name=names, **arrays)

    def wrench(self, time_ns: int, six: Any) -> Any:
        """Make a wrench."""
        vectors = [self.make("geometry_msgs/msg/Vector3", **dict(zip("xyz", part, strict=True))) for part in six]
        wrench = self.make("geometry_msgs/msg/Wrench", force=vectors[0], torque=vectors[1])
        return self.make("geometry_msgs/msg/WrenchStamped", header=self.header(time_ns), wrench=wrench)

    def write(self, topic: str, message: Any, recorded_ns: int) -> None:
        """Write a message."""
        kind = message.__msgtype__
        if topic not in self._topics:
            self._topics[topic] = self._writer.add_connection(topic, kind, typestore=self.store)
        one = self._storage == "bag"
        data = self.store.serialize_ros1(message, kind) if one else self.store.serialize_cdr(message, kind)
        self._writer.write(self._topics[topic], recorded_ns, data)

    def __enter__(self) -> Bag:
        self._writer.open()
        return self

    def __exit__(self, *args: object) -> None:
        self._writer.close()


@contextmanager
def bag(folder: Path, storage: str) -> Iterator[tuple[Bag, list[Path]]]:
    """Write a bag; its file is in the list afterwards."""
    found: list[Path] = []
    path = folder / ("run.bag" if storage == "bag" else "run")
    with Bag(path, storage) as writer:
        yield writer, found
    found.extend([path] if storage == "bag" else sorted(path.glob(f"*.{storage}")))


@pytest.mark.parametrize("storage", STORAGES)
def test_joint_states(tmp_path: Path, storage: str) -> None:
    """A driver lists joints by the alphabet, with fingers among them, and a gripper speaks on the same topic."""
    want = motion(rows=40, joints=7)
    q, dq, tau = (want.channels[name] for name in ("q", "dq", "tau"))
    names = ["finger", *reversed(PANDA)]
    with bag(tmp_path, storage) as (writer, found):
        for k in range(40):
            now = START_NS + k * STEP_NS
            rows = [[0.02, *values[k][::-1]] for values in (q, dq, tau)]
            writer.write("/joint_states", writer.joints(now, names, *rows), now + 500_000)
            if k % 4 == 0:
                writer.write("/joint_states", writer.joints(now, ["finger"], [0.02], [0.0], [1.0]), now + 600_000)
    got = Recording.read(found[0])
    assert got.format == "ros_bag"
    np.testing.assert_allclose(got.t, 0.001 * np.arange(40), atol=1e-12)
    for name in ("q", "dq", "tau"):
        np.testing.assert_array_equal(got.channels[name], want.channels[name])
    assert any("panda_joint1, panda_joint2" in note for note in got.notes)
    assert "10 messages of other joints not read" in got.notes
    assert any("1700000000.123457" in note for note in got.notes)


@pytest.mark.parametrize("storage", STORAGES)
def test_franka_state_is_preferred_and_its_sign_turned(tmp_path: Path, storage: str) -> None:
    """Both versions of franka_ros publish the whole state: it says more than the joint states beside it."""
    q, dq, tau = (np.arange(7.0) + offset for offset in (0.1, 0.2, 0.3))
    six = (np.array([1.0, 2.0, 3.0]), np.array([0.1, 0.2, 0.3]))
    with bag(tmp_path, storage) as (writer, found):
        for k in range(5):
            now = START_NS + k * STEP_NS
            writer.write("/joint_states", writer.joints(now, list(PANDA), q, dq, tau), now)
            if storage == "bag":
                fields = {"q": q, "dq": dq, "tau_J": tau, "tau_ext_hat_filtered": 2 * tau}
                fields |= {"O_F_ext_hat_K": np.concatenate(six)}
                state = writer.make("franka_msgs/msg/FrankaState", header=writer.header(now), **fields)
            else:
                state = writer.make(
                    "franka_msgs/msg/FrankaRobotState",
                    header=writer.header(now),
                    measured_joint_state=writer.joints(now, [], q, dq, tau),
                    tau_ext_hat_filtered=writer.joints(now, [], [], [], 2 * tau),
                    o_f_ext_hat_k=writer.wrench(now, six),
                )
            writer.write("/robot_state", state, now)
    got = Recording.read(found[0])
    np.testing.assert_array_equal(got.channels["tau"], np.tile(tau, (5, 1)))
    np.testing.assert_array_equal(got.channels["tau_ext"], np.tile(-2 * tau, (5, 1)))
    np.testing.assert_array_equal(got.channels["wrench"], np.tile(-np.concatenate(six), (5, 1)))
    assert "topics not read: /joint_states" in got.notes


def test_a_wrench_alone(tmp_path: Path) -> None:
    """A force/torque sensor's bag can be monitored, too; a stamp of zero falls back to the time of recording."""
    with bag(tmp_path, "mcap") as (writer, found):
        for k in range(5):
            six = (np.array([float(k), 0.0, 0.0]), np.zeros(3))
            writer.write("/ft", writer.wrench(0, six), START_NS + k * STEP_NS)
    got = Recording.read(found[0])
    np.testing.assert_allclose(got.t, 0.001 * np.arange(5), atol=1e-12)
    assert got.wrench is not None
    np.testing.assert_array_equal(got.wrench[:, 0], np.arange(5.0))


def test_joints_without_velocity_of_an_unknown_arm(tmp_path: Path) -> None:
    """Nothing is invented: empty fields give no channel, and joints stay as they come."""
    with bag(tmp_path, "mcap") as (writer, found):
        for k in range(5):
            now = START_NS + k * STEP_NS
            writer.write("/joint_states", writer.joints(now, ["b", "a"], [2.0, 1.0], [], []), now)
    got = Recording.read(found[0])
    assert list(got.channels) == ["q"]
    np.testing.assert_array_equal(got.channels["q"][0], [2.0, 1.0])
    assert "joints: b, a" in got.notes


def test_a_bag_is_monitored(tmp_path: Path) -> None:
    """The whole way, from a bag to the same timeline as from the recording it holds."""
    want = motion(rows=400, joints=7)
    q, dq, tau = (want.channels[name] for name in ("q", "dq", "tau"))
    with bag(tmp_path, "mcap") as (writer, found):
        for k in range(400):
            now = k * STEP_NS + 10**9
            writer.write("/joint_states", writer.joints(now, list(PANDA), q[k], dq[k], tau[k]), now)
    got = Recording.read(found[0])
    monitor = Monitor(Robot.load("panda"))
    assert [event.kind for event in monitor.run(got)] == [event.kind for event in monitor.run(want)]


@pytest.mark.parametrize("storage", STORAGES)
def test_bad_bags_end_in_one_line(tmp_path: Path, storage: str, capsys: pytest.CaptureFixture[str]) -> None:
    """Torn, of other topics, or named otherwise: what and where, and what to do."""
    with bag(tmp_path, storage) as (writer, found):
        for k in range(50):
            vector = writer.make("geometry_msgs/msg/Vector3", x=0.0, y=0.0, z=0.0)
            message = writer.make("geometry_msgs/msg/Vector3Stamped", header=writer.header(START_NS), vector=vector)
            writer.write("/elsewhere", message, START_NS + k)
    with pytest.raises(RecordingError, match=r"no topic has joint states .* /elsewhere \(geometry_msgs"):
        Recording.read(found[0])
    torn = tmp_path / f"torn.{storage}"
    torn.write_bytes(found[0].read_bytes()[:300])
    with pytest.raises(RecordingError, match="damaged"):
        Recording.read(torn)
    renamed = tmp_path / "run.csv"
    renamed.write_bytes(found[0].read_bytes())
    assert main(["info", str(renamed)]) == 2
    (line,) = capsys.readouterr().err.strip().splitlines()
    assert f"let its name end with .{storage}" in line


def test_a_database_that_is_no_bag(tmp_path: Path) -> None:
    """Other programs use SQLite, too."""
    path = tmp_path / "other.db3"
    with sqlite3.connect(path) as database:
        database.execute("CREATE TABLE pets (name TEXT)")
    with pytest.raises(RecordingError, match="damaged or not what it looks like"):
        Recording.read(path)
