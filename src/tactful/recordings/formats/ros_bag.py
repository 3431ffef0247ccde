"""ROS bags, of ROS 1 (.bag) and ROS 2 (.mcap, .db3): the messages of one topic with joint states, or with a wrench."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from operator import attrgetter
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from tactful.recordings._errors import RecordingError
from tactful.recordings._table import Table, damaged, short_list
from tactful.robots import Robot

if TYPE_CHECKING:
    from rosbags.highlevel import AnyReader

_SUFFIXES = {b"\x89MCAP0\r\n": ".mcap", b"SQLite format 3\x00": ".db3", b"#ROSBAG V2.0": ".bag"}

Names = tuple[str, ...]
"""The joints of a message, in its order; empty where it does not name them."""


@dataclass(frozen=True)
class _Kind:
    """What is taken from messages of a type: columns, and the fields that hold them."""

    type: str
    columns: dict[str, Callable[[Any], Any]]
    names: Callable[[Any], Any] = lambda message: ()


def _wrench(field: str) -> Callable[[Any], list[float]]:
    def six(message: Any) -> list[float]:
        wrench = attrgetter(field)(message)
        return [getattr(part, axis) for part in (wrench.force, wrench.torque) for axis in "xyz"]

    return six


_KINDS = (
    _Kind(
        "franka_msgs/msg/FrankaRobotState",
        {
            "q": attrgetter("measured_joint_state.position"),
            "dq": attrgetter("measured_joint_state.velocity"),
            "tau_J": attrgetter("measured_joint_state.effort"),
            "tau_ext_hat_filtered": attrgetter("tau_ext_hat_filtered.effort"),
            "O_F_ext_hat_K": _wrench("o_f_ext_hat_k.wrench"),
        },
    ),
    _Kind(
        "franka_msgs/msg/FrankaState",
        {name: attrgetter(name) for name in ("q", "dq", "tau_J", "tau_ext_hat_filtered", "O_F_ext_hat_K")},
    ),
    _Kind(
        "sensor_msgs/msg/JointState",
        {name: attrgetter(name) for name in ("position", "velocity", "effort")},
        attrgetter("name"),
    ),
    _Kind("geometry_msgs/msg/WrenchStamped", {"wrench": _wrench("wrench")}),
)
"""The types that are read; the first of them that a bag has is taken."""


def matches(head: bytes) -> bool:
    """The letters that bags begin with."""
    return any(head.startswith(magic) for magic in _SUFFIXES)


def open_table(path: Path) -> Table:
    """Columns of the topic that says most, its messages as rows.

    Joints are those of a built-in arm, in its order, where the messages name them all; else all, as they come. Messages
    on the topic that are of other joints (a gripper) are left out. Time is the stamp of the header, or where that is
    zero, when the message was recorded; it starts at 0.

    Raises:
        RecordingError: rosbags is not installed, the file is torn, or no topic has joint states or a wrench.
    """
    try:
        from rosbags.highlevel import AnyReader, AnyReaderError
        from rosbags.typesys import Stores, get_typestore
    except ImportError:
        raise RecordingError('ROS bags need rosbags: pip install "tactful[bags]"', path=path) from None
    with path.open("rb") as file:
        head = file.read(16)
    suffix = next(suffix for magic, suffix in _SUFFIXES.items() if head.startswith(magic))
    if path.suffix != suffix:
        raise RecordingError(f"this is a ROS bag by its content: let its name end with {suffix}", path=path)
    try:
        with AnyReader([path], default_typestore=get_typestore(Stores.LATEST)) as reader:
            return _table(path, reader)
    except (AnyReaderError, AssertionError, KeyError) as error:
        raise damaged(path, error) from error


def _table(path: Path, reader: AnyReader) -> Table:
    for kind in _KINDS:
        topics = Counter({c.topic: c.msgcount for c in reader.connections if c.msgtype == kind.type})
        for topic, _ in topics.most_common():
            columns, notes = _columns(kind, _messages(reader, topic))
            if columns:
                return _finished(path, columns, [f"topic {topic} ({kind.type})", *notes, *_others(reader, topic)])
    found = ", ".join(sorted({f"{c.topic} ({c.msgtype})" for c in reader.connections})) or "none"
    kinds = ", ".join(kind.type for kind in _KINDS)
    raise RecordingError(f"no topic has joint states or a wrench ({kinds}); its topics: {found}", path=path)


def _finished(path: Path, columns: dict[str, NDArray[np.float64]], notes: list[str]) -> Table:
    return Table(
        path=path,
        format="ros_bag",
        names=tuple(columns),
        rows=len(columns["time_s"]),
        load=columns.__getitem__,
        load_text=lambda name: [],
        widths={name: values.shape[1] for name, values in columns.items() if values.ndim == 2},
        notes=tuple(notes),
    )


def _messages(reader: AnyReader, topic: str) -> Iterator[tuple[int, Any]]:
    """Yield the messages of a topic with their time [ns]."""
    connections = [connection for connection in reader.connections if connection.topic == topic]
    for connection, recorded, data in reader.messages(connections):
        message: Any = reader.deserialize(data, connection.msgtype)
        stamp = message.header.stamp
        yield (stamp.sec * 1_000_000_000 + stamp.nanosec) or recorded, message


def _columns(kind: _Kind, messages: Iterator[tuple[int, Any]]) -> tuple[dict[str, NDArray[np.float64]], list[str]]:
    """Return `time_s` and the columns of all messages that are of the same joints; none if they hold no numbers."""
    times: dict[Names, list[int]] = {}
    rows: dict[Names, dict[str, list[Any]]] = {}
    for time_ns, message in messages:
        names = tuple(kind.names(message))
        if names not in rows:
            times[names], rows[names] = [], {name: [] for name in kind.columns}
        times[names].append(time_ns)
        for name, field in kind.columns.items():
            rows[names][name].append(field(message))
    if not rows:
        return {}, []
    by_count = sorted(rows, key=lambda names: -len(times[names]))
    arms = {names: arm for names in by_count if (arm := _arm(names)) is not None}
    names = next(iter(arms), by_count[0])
    order = [names.index(joint) for joint in arms[names]] if arms else slice(None)
    t_ns = np.array(times[names], dtype=np.int64)
    columns = {"time_s": 1e-9 * (t_ns - t_ns[0])}
    for name, values in rows[names].items():
        with suppress(ValueError):  # of lists that are not of one length: not all messages have the field
            block = np.array(values, dtype=np.float64)
            if block.shape[1]:
                columns[name] = block[:, order]
    notes = [f"time starts at 0 in the first message, which is stamped {t_ns[0] / 1e9:.6f} s"]
    if names:
        notes.append(f"joints: {', '.join(arms.get(names, names))}")
    if others := sum(len(times[other]) for other in by_count if other != names):
        notes.append(f"{others} messages of other joints not read")
    return (columns if len(columns) > 1 else {}), notes


def _arm(names: Names) -> Names | None:
    """Return the joints of a built-in arm, if all of them are there."""
    robots = (Robot.load(name) for name in Robot.names())
    return next((robot.joint_names for robot in robots if set(robot.joint_names) <= set(names)), None)


def _others(reader: AnyReader, topic: str) -> list[str]:
    known = {kind.type for kind in _KINDS}
    others = sorted({c.topic for c in reader.connections if c.msgtype in known} - {topic})
    return [f"topics not read: {short_list(others)}"] if others else []
