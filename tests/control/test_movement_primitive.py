"""The movement primitive: it has to go where it was shown, smoothly, and as slowly as it is told."""

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from tactful.control import MinimumJerkPath, MovementPrimitive, Pose, orientation_error
from tactful.errors import TactfulError

pytest.importorskip("movement_primitives", reason="teaching needs the extra `teach`")

STEPS = np.arange(0.0, 4.6, 0.013)


def pose(x: float, y: float, z: float, turn: float = 0.0) -> Pose:
    """Return a pose that points downwards, turned [rad]."""
    rotation = Rotation.from_rotvec([turn, 0.0, turn / 2]) * Rotation.from_rotvec([np.pi, 0.0, 0.0])
    return Pose(rotation.as_matrix(), np.array([x, y, z]))


PATH = MinimumJerkPath([(0.3, pose(0.4, 0.1, 0.4, 0.4)), (2.3, pose(0.5, 0.0, 0.2)), (4.3, pose(0.53, 0.03, 0.08))])


@pytest.fixture(scope="module")
def learnt() -> MovementPrimitive:
    """Return what is learnt from the path."""
    return MovementPrimitive(STEPS, [PATH.pose(t) for t in STEPS])


def test_goes_as_shown_and_rests_at_the_end(learnt: MovementPrimitive) -> None:
    """Insertion tolerates a millimetre across the way; a shift of one step along it is the library's."""
    for t in np.arange(0.0, 6.0, 0.07):
        shown = min((PATH.pose(s) for s in (t, t + 0.01)), key=lambda p: np.abs(p.position_m - learnt.pose(t)[1]).max())
        assert np.abs(shown.position_m - learnt.pose(t).position_m).max() < 1e-3
        assert np.abs(orientation_error(shown.rotation, learnt.pose(t).rotation)).max() < 2e-3
    assert learnt.end_s == pytest.approx(STEPS[-1], abs=0.011)
    assert np.array_equal(learnt.pose(99.0).position_m, learnt.points_m[-1])


def test_rotations_stay_rotations(learnt: MovementPrimitive) -> None:
    """A quaternion that drifts off the unit sphere would command shear."""
    for t in np.arange(0.0, 5.0, 0.3):
        R = learnt.pose(t).rotation
        assert np.abs(R @ R.T - np.eye(3)).max() < 1e-9


def test_slower_keeps_the_shape(learnt: MovementPrimitive) -> None:
    """Slowing down is how limits of velocity are kept: the way itself must not change."""
    slow = learnt.slower(2.0)
    assert slow.end_s == pytest.approx(2 * learnt.end_s)
    for t in (0.5, 1.7, 3.3):
        assert np.abs(slow.pose(2 * t).position_m - learnt.pose(t).position_m).max() < 1e-12


def test_smooths_a_corner() -> None:
    """A seam between a plan and a demonstration may jump: what is executed has to have no step."""
    t = np.arange(0.0, 2.0, 0.01)
    jump: list[Pose] = [pose(0.4 + 0.03 * (s > 1.0), 0.0, 0.3) for s in t]
    x: NDArray[np.float64] = MovementPrimitive(t, jump).points_m[:, 0]
    assert np.abs(np.diff(x)).max() < 0.006


def bad(*values: float) -> Pose:
    """Return a pose at a place."""
    return Pose(np.eye(3), np.array(values))


@pytest.mark.parametrize(
    ("t", "poses", "named"),
    [
        ([0.0, 1.0], [bad(0, 0, 0)], "one time a pose"),
        ([0.0, 0.0, 1.0], [bad(0, 0, 0)] * 3, "increasing times"),
        ([0.0, 0.1], [bad(0, 0, 0)] * 2, "0.2 s or more"),
        ([0.0, 1.0], [bad(0, 0, 0), bad(np.nan, 0, 0)], "not finite"),
    ],
)
def test_bad_examples_are_named(t: list[float], poses: list[Pose], named: str) -> None:
    """What cannot be learnt ends in one line that says why."""
    with pytest.raises(TactfulError, match=named) as caught:
        MovementPrimitive(t, poses)
    assert "\n" not in str(caught.value)
