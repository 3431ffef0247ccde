"""What becomes of a way that a hand has led: the arm goes it by itself from then on."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from tactful.control import MinimumJerkPath, Pose, reach
from tactful.live.view._messages import Array
from tactful.reaction import TaughtPath, merge
from tactful.robots import Robot
from tactful.simulation import Path, Rounds

_HOMEWARD_M_S = 0.15
_STEP_S = 0.01


class Backwards:
    """A path from its end to its beginning.

    Args:
        path: the path.
    """

    def __init__(self, path: Path) -> None:
        self.path, self.end_s = path, path.end_s

    def pose(self, t: float) -> Pose:
        """Return the pose at the time t [s]."""
        return self.path.pose(self.end_s - min(max(t, 0.0), self.end_s))


def keep(taught: Sequence[TaughtPath], plan: Rounds, robot: Robot, posture: Array) -> Rounds:
    """Return rounds that go the way that a hand has led last, and on to the end from where it let go.

    The leg on which the hand took over is merged with it, see `tactful.reaction.merge`; the other leg is the same way
    in the other direction.

    Args:
        taught: the ways that hands have led.
        plan: the rounds in which they took over.
        robot: the arm.
        posture: joint positions near the way (n,) [rad].

    Raises:
        TactfulError: if no plan can be made of it.
    """
    at_s, back = plan.along(taught[-1].plan_s)
    leg: Path = Backwards(plan.path) if back else plan.path
    since_s = leg.end_s - at_s if back else at_s
    led = [replace(path, plan_s=since_s) for path in taught if path.plan_s == taught[-1].plan_s]
    led[-1] = _to_the_end(led[-1], leg.pose(leg.end_s))
    start = reach(robot, leg.pose(0.0), posture)
    merged = merge(leg.pose, led, robot, start)
    return Rounds(Backwards(merged) if back else merged, plan.rest_s)


def _to_the_end(path: TaughtPath, end: Pose) -> TaughtPath:
    """Return a way that goes on to a pose from where the hand let go."""
    last = path.poses[-1]
    duration_s = max(float(np.linalg.norm(end.position_m - last.position_m)) / _HOMEWARD_M_S, 0.5)
    onward = MinimumJerkPath([(0.0, last), (duration_s, end)])
    times = np.arange(_STEP_S, duration_s + _STEP_S, _STEP_S)
    poses = tuple(onward.pose(t) for t in times.tolist())
    return replace(path, t=np.concatenate([path.t, path.t[-1] + times]), poses=path.poses + poses)
