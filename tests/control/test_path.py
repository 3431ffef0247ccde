"""Reference motions."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tactful.control import MinimumJerkPath, Pose, minimum_jerk
from tactful.errors import TactfulError

TURN = Rotation.from_rotvec([0.0, 1.2, 0.0]).as_matrix()
PATH = MinimumJerkPath(
    [
        (1.0, Pose(np.eye(3), np.zeros(3))),
        (3.0, Pose(np.eye(3), np.array([0.4, 0.0, 0.0]))),
        (4.0, Pose(TURN, np.array([0.4, 0.0, 0.2]))),
    ]
)


def test_starts_and_ends_at_rest() -> None:
    """A step in velocity or acceleration of the reference would look like a contact."""
    s = np.linspace(-0.1, 1.1, 1201)
    way = np.array([minimum_jerk(x) for x in s])
    speed = np.gradient(way, s)
    acceleration = np.gradient(speed, s)
    assert way[0] == 0
    assert way[-1] == 1
    assert speed.max() == pytest.approx(1.875, rel=1e-3)
    assert np.abs(np.diff(acceleration)).max() < 0.1


def test_goes_through_its_stops() -> None:
    """Stops are met exactly, and the path rests before and after."""
    for t, x, z in [
        (0.0, 0, 0),
        (1.0, 0, 0),
        (2.0, 0.2, 0),
        (3.0, 0.4, 0),
        (3.5, 0.4, 0.1),
        (4.0, 0.4, 0.2),
        (9, 0.4, 0.2),
    ]:
        np.testing.assert_allclose(PATH.pose(t).position_m, [x, 0, z], atol=1e-12)
    np.testing.assert_allclose(PATH.pose(4.0).rotation, TURN, atol=1e-12)
    np.testing.assert_allclose(Rotation.from_matrix(PATH.pose(3.5).rotation).as_rotvec(), [0, 0.6, 0], atol=1e-12)
    assert PATH.end_s == 4.0


def test_time_has_to_advance() -> None:
    """Stops in the wrong order are a slip that would make the reference jump."""
    rest = Pose(np.eye(3), np.zeros(3))
    with pytest.raises(TactfulError, match="follows one at 2 s"):
        MinimumJerkPath([(2.0, rest), (2.0, rest)])
    with pytest.raises(TactfulError, match="no stop"):
        MinimumJerkPath([])
