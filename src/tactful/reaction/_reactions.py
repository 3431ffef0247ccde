"""The reactions: each says where the tip is to be, and which impedance it has there."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Protocol

import numpy as np
from numpy.typing import NDArray

from tactful.control import ImpedanceConfig, MinimumJerkPath, Pose
from tactful.monitor import ContactEvent
from tactful.reaction._config import ReactionConfig, ReactionName
from tactful.reaction._trace import TRACE_STEP_S

Array = NDArray[np.float64]


class Reaction(Protocol):
    """What an arm does about one contact."""

    name: ClassVar[ReactionName]
    gives_way: ClassVar[bool]
    """Whether the arm shows its damping alone, and its motion is taken up again once it is let go."""

    def reference(self, t: float) -> Pose:
        """Return where the tip is to be at the time t [s]."""
        ...

    def notice(self, t: float, tip: Pose) -> None:
        """See where the tip is, in every sample."""
        ...


@dataclass
class Stop:
    """Hold the pose in which the contact was detected."""

    tip: Pose
    name: ClassVar[ReactionName] = "stop"
    gives_way: ClassVar[bool] = False

    def reference(self, t: float) -> Pose:
        """Return the held pose."""
        return self.tip

    def notice(self, t: float, tip: Pose) -> None:
        """Do nothing."""


class Retract:
    """Draw the tip back along the force of the contact, with minimum jerk, and hold it there.

    Args:
        t: when it begins [s].
        tip: where the tip is.
        direction: unit vector of the force on the robot (3,), base axes.
        config: how far, and in what time.
    """

    name: ClassVar[ReactionName] = "retract"
    gives_way: ClassVar[bool] = False

    def __init__(self, t: float, tip: Pose, direction: Array, config: ReactionConfig) -> None:
        back = Pose(tip.rotation, tip.position_m + config.retract_m * direction)
        self._path = MinimumJerkPath([(t, tip), (t + config.retract_s, back)])

    def reference(self, t: float) -> Pose:
        """Return the pose on the way back."""
        return self._path.pose(t)

    def notice(self, t: float, tip: Pose) -> None:
        """Do nothing."""


@dataclass
class Comply:
    """Give way: no stiffness, the damping is kept."""

    tip: Pose
    name: ClassVar[ReactionName] = "comply"
    gives_way: ClassVar[bool] = True

    def reference(self, t: float) -> Pose:
        """Return where the tip is; without stiffness it pulls nowhere."""
        return self.tip

    def notice(self, t: float, tip: Pose) -> None:
        """Follow the tip."""
        self.tip = tip


@dataclass(frozen=True)
class TaughtPath:
    """Where a hand led the tip.

    Attributes:
        t: times (N,) [s].
        poses: the N poses of the tip.
        plan_s: time in the plan at which the hand was recognised, and the plan stood still [s].
        clear_s: time in the plan until which nothing was touched [s]; None where that is not known.
    """

    t: Array
    poses: tuple[Pose, ...]
    plan_s: float
    clear_s: float | None = None


class Teach(Comply):
    """Give way to a hand, and remember where it leads.

    Args:
        tip: where the tip is.
        held: the orientation that is held (3, 3); by default it gives way, too.
    """

    name: ClassVar[ReactionName] = "teach"

    def __init__(self, tip: Pose, held: Array | None = None) -> None:
        super().__init__(tip)
        self.held = held
        self._times: list[float] = []
        self._poses: list[Pose] = []

    def reference(self, t: float) -> Pose:
        """Return where the tip is, with the orientation that is held."""
        return self.tip if self.held is None else Pose(self.held, self.tip.position_m)

    def notice(self, t: float, tip: Pose) -> None:
        """Follow the tip and remember it, every 10 ms."""
        super().notice(t, tip)
        if not self._times or t - self._times[-1] >= TRACE_STEP_S - 1e-9:
            self._times.append(t)
            self._poses.append(tip)

    def remember(self, samples: list[tuple[float, Pose]]) -> None:
        """Put before what was seen where the tip had been led already."""
        self._times = [t for t, _ in samples] + self._times
        self._poses = [tip for _, tip in samples] + self._poses

    def taught(self, plan_s: float, clear_s: float | None = None) -> TaughtPath:
        """Return the way so far."""
        return TaughtPath(np.array(self._times), tuple(self._poses), plan_s, clear_s)


def make(
    name: ReactionName, t: float, tip: Pose, wanted: Pose, event: ContactEvent, config: ReactionConfig
) -> Reaction | None:
    """Return the reaction to an event, None to go on. A force whose direction is not known stops the arm instead.

    Args:
        name: the reaction.
        t: time [s].
        tip: where the tip is.
        wanted: where the plan wanted it.
        event: the contact.
        config: the policy.
    """
    if name == "continue":
        return None
    if name == "comply":
        return Comply(tip)
    if name == "teach":
        return Teach(tip, wanted.rotation if config.guiding == "translation" else None)
    size = float(np.linalg.norm(event.force_n))
    if name == "stop" or event.damped or size < 1e-9:
        return Stop(tip)
    return Retract(t, tip, np.array(event.force_n) / size, config)


def giving_way(impedance: ImpedanceConfig) -> ImpedanceConfig:
    """Return an impedance without its stiffness, with the damping that it had."""
    linear, angular = impedance.damping
    return impedance.model_copy(
        update={
            "stiffness_n_m": 0.0,
            "stiffness_nm_rad": 0.0,
            "posture_stiffness_nm_rad": 0.0,
            "damping_ns_m": linear,
            "damping_nms_rad": angular,
        }
    )
