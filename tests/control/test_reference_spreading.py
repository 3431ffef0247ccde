"""References on both sides of an impact."""

import numpy as np
import pytest

from tactful.control import ReferenceSpreading
from tactful.errors import TactfulError

SPREAD = ReferenceSpreading.between((0.1, 0.5, 1.0), [[0.0, 0.2], [0.1, 0.0], [0.15, 0.0]], [[0.2, -0.3], [0.15, 0.0]])


def test_meets_its_poses_with_the_velocity_jump() -> None:
    """At t_d the references share the pose and differ in velocity; all accelerations there are zero."""
    for t, post, x, dx in [
        (0.1, False, [0, 0.2], [0, 0]),
        (0.5, False, [0.1, 0], [0.2, -0.3]),
        (0.5, True, [0.1, 0], [0.15, 0]),
        (1.0, True, [0.15, 0], [0, 0]),
    ]:
        found = SPREAD.at(t, post=post)
        for value, expected in zip(found, (x, dx, [0, 0]), strict=True):
            np.testing.assert_allclose(value, expected, atol=1e-12)


def test_goes_on_at_constant_velocity() -> None:
    """An impact that comes early or late finds a reference on both sides."""
    x, dx, ddx = SPREAD.at(0.6, post=False)
    np.testing.assert_allclose(x, [0.12, -0.03], atol=1e-12)
    np.testing.assert_allclose(dx, [0.2, -0.3], atol=1e-12)
    np.testing.assert_allclose(ddx, 0)
    np.testing.assert_allclose(SPREAD.at(0.4, post=True)[0], [0.085, 0.0], atol=1e-12)
    np.testing.assert_allclose(SPREAD.at(2.0, post=True)[0], [0.15, 0.0], atol=1e-12)


@pytest.mark.parametrize("post", [False, True])
def test_velocity_and_acceleration_are_derivatives(post: bool) -> None:
    """The feed-forward has to fit the motion."""
    t, h = np.linspace(0.12, 0.98, 87), 1e-5
    for s in t[np.abs(t - 0.5) > 1e-3]:
        before, here, after = (SPREAD.at(s + step, post=post) for step in (-h, 0.0, h))
        np.testing.assert_allclose((after[0] - before[0]) / (2 * h), here[1], atol=1e-6)
        np.testing.assert_allclose((after[1] - before[1]) / (2 * h), here[2], atol=1e-6)


def test_bad_input() -> None:
    """Times out of order would divide by zero or run backwards."""
    with pytest.raises(TactfulError, match="increasing"):
        ReferenceSpreading.between((0.0, 0.5, 0.4), np.zeros((3, 1)), np.zeros((2, 1)))
    with pytest.raises(TactfulError, match="expected"):
        ReferenceSpreading.between((0.0, 0.5, 1.0), np.zeros((2, 1)), np.zeros((2, 1)))
