"""Joint states from a ROS 2 topic."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from importlib import import_module
from operator import itemgetter
from typing import Any

import numpy as np

from tactful.live._clock import Patience
from tactful.live._source import ConnectionLostError, Sample, Source, SourceError
from tactful.live.sources import Settings
from tactful.live.sources._arm import find_arm
from tactful.monitor import ContactEvent
from tactful.robots import Robot

FORM = "ros2:/TOPIC"

EVENTS = "/tactful/events"
"""Topic on which events are published, as JSON in a std_msgs/String."""
_TYPES = ("sensor_msgs/msg/JointState", "franka_msgs/msg/FrankaRobotState")
_DISCOVERY_S = 3.0
_SILENCE_S = 1.0
_WAIT_S, _LOOK_S = 0.1, 0.2
_FIRST = 21
_QUEUE = 1000
_IDLE = 10


class Ros2Source(Source):
    """The messages of a topic: sensor_msgs/JointState, or franka_msgs/FrankaRobotState where that is installed.

    Joints are found by their names; others may be in the message. Time is the stamp of the header, or where that is
    zero, when the message was sent. Each event is published on `/tactful/events`. The arm is listened to.

    Args:
        name: what the user called it.
        topic: the topic.
        settings: the arm.
    """

    robot: Robot

    def __init__(self, name: str, topic: str, settings: Settings) -> None:
        try:
            import rclpy
        except ImportError:
            raise SourceError(
                name, 'needs rclpy: source a ROS 2 installation of this Python, or pip install "tactful[ros2]"'
            ) from None
        self.name, self._topic, self._rclpy = name, topic, rclpy
        self.robot = find_arm(name, settings.config, default=None)
        self.config = settings.config
        self._context: Any = None
        self._messages: deque[tuple[Any, int]] = deque()
        self._pick: Any = None
        self._names: Sequence[str] = ()
        self._sequence: int | None = None
        self._lost = 0

    def open(self) -> None:
        """Join the graph, wait for a publisher of the topic, and find the rate from its first messages.

        Raises:
            SourceError: if nobody publishes, the messages are of another type, or they are of another arm.
        """
        from rclpy.executors import SingleThreadedExecutor

        self._context = self._rclpy.Context()
        self._rclpy.init(context=self._context)
        try:
            self._node = self._rclpy.create_node("tactful", context=self._context)
            self._executor = SingleThreadedExecutor(context=self._context)
            self._executor.add_node(self._node)
            self._subscribe()
            self._first_messages()
        except BaseException:
            self.close()
            raise

    def _subscribe(self) -> None:
        from rclpy.qos import QoSProfile
        from std_msgs.msg import String

        kind, reliability = self._find_topic()
        try:
            package, _, name = kind.rpartition("/")
            message = getattr(import_module(package.replace("/", ".")), name)
        except (ImportError, AttributeError):
            raise SourceError(self.name, f"its messages, {kind}, are not installed for this Python") from None
        profile = QoSProfile(depth=_QUEUE, reliability=reliability)
        self._messages.clear()
        self._sequence = None
        self._node.create_subscription(message, self._topic, self._receive, profile)
        self._publisher = self._node.create_publisher(String, EVENTS, 100)
        self._string = String

    def _find_topic(self) -> tuple[str, Any]:
        """Return the type of the topic, and the reliability that its publishers offer."""
        from rclpy.qos import ReliabilityPolicy

        patience = Patience(_DISCOVERY_S, _LOOK_S)
        while True:
            self._executor.spin_once(timeout_sec=_WAIT_S)
            publishers = self._node.get_publishers_info_by_topic(self._topic)
            if publishers:
                break
            if patience.over():
                others = [topic for topic, kinds in self._node.get_topic_names_and_types() if {*kinds} & {*_TYPES}]
                hint = f"joint states are on {', '.join(others)}" if others else "there are no joint states at all"
                raise SourceError(self.name, f"nobody publishes on {self._topic}: {hint}; check also ROS_DOMAIN_ID")
        kind = publishers[0].topic_type
        if kind not in _TYPES:
            raise SourceError(self.name, f"{self._topic} carries {kind}, which has no joint states: use {_TYPES[0]}")
        offered = {publisher.qos_profile.reliability for publisher in publishers}
        best_effort = ReliabilityPolicy.BEST_EFFORT
        return kind, best_effort if best_effort in offered else ReliabilityPolicy.RELIABLE

    def _first_messages(self) -> None:
        patience = Patience(_DISCOVERY_S, _LOOK_S)
        while len(self._messages) < _FIRST and not patience.over():
            self._executor.spin_once(timeout_sec=_WAIT_S)
        if len(self._messages) < 2:
            raise SourceError(self.name, f"{self._topic} has a publisher, but it sends no messages")
        samples = [self._sample(message, sent) for message, sent in self._messages]
        steps = np.diff([sample.t for sample in samples])
        if not (steps > 0).any():
            raise SourceError(self.name, f"the time stamps of {self._topic} do not advance")
        self.rate_hz = float(1 / np.median(steps[steps > 0]))

    def _receive(self, message: Any, info: Any) -> None:
        number = info["publication_sequence_number"]
        if self._sequence is not None and number > self._sequence + 1:
            self._lost += number - self._sequence - 1
        self._sequence = number
        self._messages.append((message, info["source_timestamp"]))

    def read(self) -> Sample | None:
        """Wait for the next message; None if none comes for a tenth of a second."""
        patience = Patience(_SILENCE_S, _LOOK_S)
        while not self._messages:
            self._executor.spin_once(timeout_sec=_WAIT_S)
            if not self._messages and patience.over():
                raise ConnectionLostError(self.name, f"{self._topic} has been silent for {_SILENCE_S:g} s")
        return self._sample(*self._messages.popleft())

    def begin(self) -> None:
        """Leave out what came while the kernels were compiled."""
        lost, idle = self._lost, 0
        for _ in range(4 * _QUEUE):
            queued = len(self._messages)
            self._executor.spin_once(timeout_sec=0.0)  # which may also wake for nothing
            idle = 0 if len(self._messages) > queued else idle + 1
            if idle == _IDLE:
                break
        self._messages.clear()
        self._sequence, self._lost = None, lost

    def _sample(self, message: Any, sent_ns: int) -> Sample:
        stamp = message.header.stamp
        state = getattr(message, "measured_joint_state", message)
        if self._pick is None or state.name != self._names:
            self._pick, self._names = self._chooser(state), list(state.name)
        t = stamp.sec + 1e-9 * stamp.nanosec or 1e-9 * sent_ns
        try:
            return Sample(t, self._pick(state.position), self._pick(state.velocity), self._pick(state.effort))
        except IndexError:
            raise SourceError(
                self.name,
                f"{self._topic} has {len(state.position)} positions, {len(state.velocity)} velocities and "
                f"{len(state.effort)} efforts for {len(state.name)} joints: all three are needed",
            ) from None

    def _chooser(self, state: Any) -> Any:
        """Return what picks the arm's joints, in their order."""
        places = {name: place for place, name in enumerate(state.name)}
        if missing := [name for name in self.robot.joint_names if name not in places]:
            raise SourceError(
                self.name,
                f"{self._topic} has no joint {missing[0]} of {self.robot.name}: it has {', '.join(state.name)}; "
                "choose its robot",
            )
        return itemgetter(*(places[name] for name in self.robot.joint_names))

    def lost(self) -> int:
        """Return how many messages are missing by their sequence numbers."""
        return self._lost

    def tell(self, event: ContactEvent) -> None:
        """Publish an event."""
        if self._context is not None and self._context.ok():
            self._publisher.publish(self._string(data=event.to_json()))

    def close(self) -> None:
        """Leave the graph."""
        if self._context is not None:
            context, self._context = self._context, None
            self._executor.shutdown()
            self._node.destroy_node()
            context.try_shutdown()


def create(name: str, address: str, settings: Settings) -> Source:
    """See `tactful.live.sources`."""
    if not address.startswith("/") or len(address) < 2:
        raise SourceError(name, "no topic is named: ros2:/TOPIC, as in ros2:/joint_states")
    if settings.react:
        raise SourceError(name, "a topic takes no torques, so nothing can be done about contacts")
    return Ros2Source(name, address, settings)
