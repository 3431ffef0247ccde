"""The cell of the live page: a hand that holds on wherever the mouse goes, an obstacle that moves."""

import numpy as np
import pytest

from tactful.control import MinimumJerkPath, Pose
from tactful.errors import TactfulError
from tactful.simulation import Drag, Rounds, workshop


def test_drag_is_a_spring_of_bounded_strength() -> None:
    """A hand that is far away must not tear: the spring ends at its strength, the damper acts besides."""
    hand = Drag(link="panda_link7", stiffness_n_m=100.0, damping_ns_m=2.0, strength_n=10.0)
    assert not hand.acts(0.0)
    hand.target_m = (0.05, 0.0, 0.0)
    assert hand.acts(0.0)
    np.testing.assert_allclose(hand.force(0.0, np.zeros(3), np.array([0.0, 1.0, 0.0])), [5.0, -2.0, 0.0])
    hand.target_m = (0.0, 0.0, 3.0)
    np.testing.assert_allclose(hand.force(0.0, np.zeros(3), np.zeros(3)), [0.0, 0.0, 10.0])


def test_rounds_go_there_and_back_for_ever() -> None:
    """The reference must be continuous over many rounds, or the arm would jump."""
    path = MinimumJerkPath([(0.0, Pose(np.eye(3), np.zeros(3))), (2.0, Pose(np.eye(3), np.array([0.4, 0.0, 0.0])))])
    rounds = Rounds(path, rest_s=0.5)
    x = np.array([rounds(t).position_m[0] for t in np.arange(0.0, 12.0, 0.01)])
    assert np.abs(np.diff(x)).max() < 0.01
    assert (x[0], x[225], x[490]) == (0.0, 0.4, 0.0)
    assert rounds.along(3.0) == (1.5, True)


def test_obstacle_moves_into_the_arm_and_hand_draws_it() -> None:
    """What the page offers has to touch the arm: both touches are in the truth, under their kinds."""
    shop = workshop(np.random.default_rng(0))
    tip = shop.plan(0.0).position_m
    shop.move([tip[0], tip[1] + 0.08, 0.3])
    shop.hands[6].target_m = (float(tip[0]), float(tip[1]) + 0.15, float(tip[2]))
    for _ in range(600):
        shop.cell.step(np.zeros(7))
    assert {contact.kind for contact in shop.cell.contacts} == {"cooperation", "collision"}
    with pytest.raises(TactfulError, match="movable"):
        shop.cell.move("table", [0.0, 0.0, 0.0])
