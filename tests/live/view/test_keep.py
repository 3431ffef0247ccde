"""What a hand has led becomes the way of the arm, in both directions."""

import numpy as np
import pytest

from tactful.control import Pose
from tactful.live.view._keep import keep
from tactful.reaction import TaughtPath
from tactful.simulation import workshop

pytest.importorskip("movement_primitives", reason="the extra teach is not installed")


@pytest.mark.parametrize("back", [False, True])
def test_rounds_go_the_way_that_was_led(back: bool) -> None:
    """Kept corrections have to lead round the obstacle there and back, and to reach the ends of the old way."""
    shop = workshop(np.random.default_rng(0))
    plan, robot = shop.plan, shop.cell.robot
    leg_s = plan.path.end_s + plan.rest_s
    plan_s = 1.2 + back * leg_s
    start = plan(plan_s)
    s = np.linspace(0.0, 1.0, 120)
    way = (-0.2 if back else 0.2) * np.outer(s, [0.0, 1.0, 0.0]) + np.outer(np.sin(np.pi * s), [0.0, 0.0, 0.1])
    poses = tuple(Pose(start.rotation, start.position_m + step) for step in way)
    rounds = keep([TaughtPath(0.01 * np.arange(120), poses, plan_s)], plan, robot, shop.posture)
    for old, new in ((0.0, 0.0), (plan.path.end_s, rounds.path.end_s)):
        np.testing.assert_allclose(rounds.path.pose(new).position_m, plan.path.pose(old).position_m, atol=0.01)
    track = np.array([rounds.path.pose(t).position_m for t in np.arange(0.0, rounds.path.end_s, 0.02)])
    summit = np.add(start.position_m, (0.0, -0.1 if back else 0.1, 0.1))
    assert np.linalg.norm(track - summit, axis=1).min() < 0.02
    assert np.linalg.norm(np.diff(track, axis=0), axis=1).max() < 0.02
