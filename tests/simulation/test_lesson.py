"""A lesson: the arm gets stuck, is led into the hole, and the monitor alone tells it what to do."""

import numpy as np
import pytest

from tactful.control import MinimumJerkPath, Pose
from tactful.monitor import Monitor, MonitorConfig
from tactful.reaction import merge
from tactful.simulation import EpisodeSpec, Lead, Lesson

pytest.importorskip("mujoco", reason="needs the extra `mujoco`")


def test_a_hand_that_leads_is_a_spring_to_a_moving_point() -> None:
    """What it exerts is bounded by its strength, and nothing where the point keeps up with it."""
    path = MinimumJerkPath([(0.0, Pose(np.eye(3), np.zeros(3))), (2.0, Pose(np.eye(3), np.array([0.2, 0.0, 0.0])))])
    hand = Lead(link="a", start_s=-1.0, hold_s=9.0, path=lambda t: path.pose(t).position_m, strength_n=5.0)
    speed = (path.pose(1.0).position_m - path.pose(0.999).position_m) / 0.001
    assert np.abs(hand.force(1.0, path.pose(1.0).position_m, speed)).max() < 1e-9
    assert np.linalg.norm(hand.force(1.0, np.array([-1.0, 0.0, 0.0]), speed)) == pytest.approx(5.0)


@pytest.mark.timeout(300)
def test_a_lesson_from_the_side_of_the_box() -> None:
    """The purpose of it all: stuck, helped, and the next time it works alone. The settings are a calibrated arm's."""
    from importlib import resources

    with resources.as_file(resources.files("tactful.simulation") / "presets" / "clean-monitor.toml") as file:
        config = MonitorConfig.load(file)
    lesson = Lesson(
        EpisodeSpec(kind="collision_then_cooperation", trajectory="side", operator="leading", place="peg", seed=0)
    )
    alone = lesson.execute(lesson.plan, lesson.end_s, Monitor(config=config), helped=False)
    assert not alone.inserted
    helped = lesson.execute(lesson.plan, lesson.end_s, Monitor(config=config), helped=True)
    assert helped.stuck_s is not None
    assert helped.led_s is not None
    assert "cooperation" in [event.kind for event in helped.events if event.detected_s > helped.led_s[0]]
    pytest.importorskip("movement_primitives", reason="needs the extra `teach`")
    taught = merge(lesson.plan, helped.reactor.taught, lesson.robot, lesson.scene.q)
    assert lesson.execute(taught.pose, taught.end_s, Monitor(config=config), helped=False).inserted
