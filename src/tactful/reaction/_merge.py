"""From a plan and a path that a hand led to the next plan."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import Field

from tactful.config import Config
from tactful.control import FOLLOW_STEP_S, ImpedanceConfig, MinimumJerkPath, MovementPrimitive, Pose, follow
from tactful.errors import TactfulError
from tactful.reaction._config import PositiveFloat
from tactful.reaction._reactions import TaughtPath
from tactful.reaction._reactor import Plan
from tactful.reaction._trace import TRACE_STEP_S
from tactful.robots import Robot

Array = NDArray[np.float64]

_REST_M = 0.002
_REST_S = 0.2
_LEAST_BRIDGE_S = 0.3
_PEAK = 1.875
"""Of the speed of a minimum-jerk motion, over its mean."""


class TeachingError(TactfulError):
    """A demonstration that no plan can be made of."""


class TeachingConfig(Config):
    """How a demonstration becomes a part of the plan."""

    margin_s: PositiveFloat = 0.4
    """How long before the first contact the plan is left for the demonstration [s]. The tip of an arm under impedance
    control is where its reference was B / K seconds ago, so this has to be longer than that."""
    least_m: PositiveFloat = 0.02
    """How far a hand has to have led the tip for it to be a demonstration [m]."""
    bridge_m_s: PositiveFloat = 0.1
    """Largest speed on the way from the plan to the demonstration [m/s]."""
    slower: Annotated[float, Field(ge=1)] = 1.5
    """By which factor the new plan is executed slower than it was planned and shown: a soft arm swings past the points
    where its reference turns, and a hand was there to hold it."""
    velocity_share: PositiveFloat = 0.8
    """Largest joint velocity in the new plan, as a share of the arm's limit (`Robot.velocity_limit`); a demonstration
    that was faster is executed slower."""


def merge(
    plan: Plan,
    taught: Sequence[TaughtPath],
    robot: Robot,
    q: ArrayLike,
    *,
    impedance: ImpedanceConfig | None = None,
    config: TeachingConfig | None = None,
) -> MovementPrimitive:
    """Return the plan for the next execution: the old one until it went wrong, then what the hand showed.

    The old plan is kept until `margin_s` before the first contact. From the point on it that is nearest to the
    demonstration a straight line leads over, and the demonstration replaces the rest. All of it is learnt as one
    `MovementPrimitive`, which smooths the seams, and executed slower, at least by `slower`, and until no joint is too
    fast.

    Source of the joining at the nearest points: M. Karlsson, A. Robertsson, R. Johansson, Autonomous Interpretation of
    Demonstrations for Modification of Dynamical Movement Primitives, ICRA 2017.

    Args:
        plan: where the tip was to be, by the time in the plan.
        taught: where it was led, as `Reactor.taught` keeps it; paths without a return to the plan between them are one.
        robot: the arm; its joints' limits hold for the new plan.
        q: joint positions at the start of the plan (n,) [rad].
        impedance: under which the plan is executed.
        config: the settings.

    Raises:
        TeachingError: if the hand led nowhere, or the new plan leaves the range of a joint.
        TactfulError: if the extra `teach` is missing.
    """
    config = config or TeachingConfig()
    led = _last_led(taught)
    positions = np.array([pose.position_m for path in led for pose in path.poses])  # (N, 3)
    reach_m = float(np.linalg.norm(positions - positions[0], axis=1).max()) if len(positions) else 0.0
    if reach_m < config.least_m:
        raise TeachingError(
            f"the hand led the tip {1e3 * reach_m:.0f} mm far: a demonstration needs {1e3 * config.least_m:.0f} mm"
        )
    poses = [pose for path in led for pose in path.poses]
    resting = np.linalg.norm(positions - positions[-1], axis=1) > _REST_M
    end = min(int(np.flatnonzero(resting)[-1]) + 1 + round(_REST_S / TRACE_STEP_S), len(poses))
    clear_s = led[0].clear_s
    until_s = led[0].plan_s if clear_s is None else min(clear_s, led[0].plan_s)
    kept = [plan(t) for t in np.arange(0.0, max(until_s - config.margin_s, 0.0) + TRACE_STEP_S, TRACE_STEP_S).tolist()]
    here = np.array([pose.position_m for pose in kept])  # (m, 3)
    distance = np.linalg.norm(here[:, None] - positions[:end], axis=-1)  # (m, end)
    leave, enter = np.unravel_index(int(np.argmin(distance)), distance.shape)
    shown = poses[enter:end]
    parts = [*kept[: leave + 1], *_bridge(kept[leave], shown[0], config.bridge_m_s), *shown]
    primitive = MovementPrimitive(TRACE_STEP_S * np.arange(len(parts)), parts).slower(config.slower)
    return _within_limits(primitive, robot, np.asarray(q, dtype=np.float64), impedance or ImpedanceConfig(), config)


def _last_led(taught: Sequence[TaughtPath]) -> list[TaughtPath]:
    """Return the last demonstration: the paths that were led while the plan stood still."""
    if not taught:
        raise TeachingError("no hand led the tip: there is nothing to merge")
    return [path for path in taught if path.plan_s == taught[-1].plan_s and len(path.poses)]


def _bridge(start: Pose, end: Pose, speed_m_s: float) -> list[Pose]:
    way_m = float(np.linalg.norm(end.position_m - start.position_m))
    duration_s = max(_PEAK * way_m / speed_m_s, _LEAST_BRIDGE_S)
    path = MinimumJerkPath([(0.0, start), (duration_s, end)])
    return [path.pose(t) for t in np.arange(TRACE_STEP_S, duration_s, TRACE_STEP_S).tolist()]


def _within_limits(
    primitive: MovementPrimitive, robot: Robot, q: Array, impedance: ImpedanceConfig, config: TeachingConfig
) -> MovementPrimitive:
    """Return the motion as fast as the joints allow, if they can do it at all."""
    track = follow(robot, primitive.pose, q, primitive.end_s, impedance)  # (k, n)
    beyond = np.maximum(robot.lower - track, track - robot.upper)  # (k, n)
    k, joint = np.unravel_index(int(np.argmax(beyond)), beyond.shape)
    if beyond[k, joint] > 0:
        raise TeachingError(
            f"the demonstration brings {robot.joint_names[joint]} to {track[k, joint]:.2f} rad, its range is "
            f"{robot.lower[joint]:.2f} to {robot.upper[joint]:.2f} rad: lead another way"
        )
    speed = np.abs(np.diff(track, axis=0)).max(axis=0, initial=0.0) / FOLLOW_STEP_S  # (n,)
    factor = float((speed / (config.velocity_share * robot.velocity_limit)).max())
    return primitive.slower(factor) if factor > 1 else primitive
