"""Merging a demonstration into a plan: what is kept, what is replaced, and what cannot be done."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import ArrayLike

from tactful.control import MinimumJerkPath, Pose
from tactful.dynamics import Dynamics
from tactful.errors import TactfulError
from tactful.reaction import TaughtPath, TeachingConfig, TeachingError, merge
from tactful.reaction._trace import Trace
from tactful.robots import Robot

pytest.importorskip("movement_primitives", reason="teaching needs the extra `teach`")

PANDA = Robot.load("panda")
R, START = Dynamics(PANDA).pose(PANDA.home)
GOAL = START + np.array([0.1, 0.2, -0.1])
PLAN = MinimumJerkPath([(0.3, Pose(R, START)), (2.3, Pose(R, GOAL))])


def led(points: ArrayLike, *, plan_s: float, seconds: float = 2.0, clear_s: float | None = 1.3) -> TaughtPath:
    """Return a path through points from START, evenly in time, and half a second of rest."""
    way = START + np.asarray(points)
    stops = [(seconds * k / max(len(way) - 1, 1), Pose(R, point)) for k, point in enumerate(way)]
    path, t = MinimumJerkPath(stops), np.arange(0.0, seconds + 0.5, 0.01)
    return TaughtPath(t, tuple(path.pose(s) for s in t), plan_s, clear_s)


AROUND = [[0.05, 0.1, -0.05], [0.05, 0.1, 0.0], [0.12, 0.15, 0.0], [0.12, 0.15, -0.08]]


def test_keeps_the_plan_until_it_failed_and_ends_where_the_hand_ended() -> None:
    """The purpose: what was right stays, the rest is what was shown."""
    new = merge(PLAN.pose, [led(AROUND, plan_s=1.6)], PANDA, PANDA.home)
    for t in np.arange(0.0, 0.7, 0.1):
        assert np.linalg.norm(new.pose(1.5 * t).position_m - PLAN.pose(t).position_m) < 0.003
    assert np.linalg.norm(new.pose(new.end_s).position_m - START - AROUND[-1]) < 1e-3
    points = new.points_m
    assert np.linalg.norm(points - START - AROUND[2], axis=1).min() < 2e-3


def test_does_not_lead_to_where_it_got_stuck() -> None:
    """The demonstration begins in contact: where it comes back to the plan is where the plan is left."""
    stuck, free = np.array([0.05, 0.1, -0.05]), PLAN.pose(0.8).position_m - START
    new = merge(PLAN.pose, [led([stuck, free, *AROUND[2:]], plan_s=1.6)], PANDA, PANDA.home)
    assert np.linalg.norm(new.points_m - START - stuck, axis=1).min() > 0.03


def test_paths_without_a_return_between_them_are_one() -> None:
    """A monitor may lose a hand for a moment; its demonstration goes on all the same, and an earlier one is over."""
    first, second = led(AROUND[:3], plan_s=1.6), led(AROUND[2:], plan_s=1.6)
    elsewhere = led([[0, 0, 0], [0, 0, 0.1]], plan_s=0.5)
    whole = merge(PLAN.pose, [elsewhere, first, second], PANDA, PANDA.home)
    assert np.linalg.norm(whole.points_m - START - AROUND[1], axis=1).min() < 2e-3
    assert np.linalg.norm(whole.points_m[-1] - START - AROUND[-1]) < 1e-3


def test_a_fast_demonstration_is_executed_slower() -> None:
    """A hand may move an arm faster than it may move itself."""
    slow_arm = replace(PANDA, velocity_limit=0.1 * PANDA.velocity_limit)
    fast, slow = (merge(PLAN.pose, [led(AROUND, plan_s=1.6)], arm, PANDA.home) for arm in (PANDA, slow_arm))
    assert slow.end_s > 1.5 * fast.end_s
    assert np.array_equal(slow.points_m, fast.points_m)


def test_a_demonstration_beyond_a_joint_is_refused() -> None:
    """A plan that the arm cannot follow would fail in the next execution, far from who taught it."""
    narrow = replace(PANDA, upper=np.where(np.arange(7) == 3, PANDA.home[3] + 0.05, PANDA.upper))
    with pytest.raises(TeachingError, match="panda_joint4") as caught:
        merge(PLAN.pose, [led(AROUND, plan_s=1.6)], narrow, PANDA.home)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("taught", [[], [led([[0, 0, 0], [0.005, 0, 0]], plan_s=1.0)]])
def test_nothing_shown_is_nothing_merged(taught: list[TaughtPath]) -> None:
    """A hand that only touched, or a false alarm, must not change the plan."""
    with pytest.raises(TeachingError, match="hand led"):
        merge(PLAN.pose, taught, PANDA, PANDA.home)


def test_settings_are_checked() -> None:
    """A slip in a setting is told at once."""
    with pytest.raises(TactfulError):
        TeachingConfig(margin_s=-1.0)


def test_a_demonstration_begins_where_the_arm_was_stuck() -> None:
    """A hand is recognised late when it draws the arm out of a collision: what it showed before counts."""
    trace = Trace()
    for k in range(600):
        x = min(k, 200) * 1e-3 + max(k - 400, 0) * 1e-3  # into something at 2 s, led on from 4 s
        if trace.due(0.01 * k):
            trace.note(0.01 * k, Pose(R, np.array([x, 0.0, 0.0])))
    assert trace.led() == []
    trace.touch(1.9, 1.9)
    trace.touch(5.0, 5.0)
    led_since = trace.led()
    assert trace.clear_s == 1.9
    assert led_since[0][0] == pytest.approx(4.02, abs=0.03)
    assert led_since[-1][0] == pytest.approx(5.99)
