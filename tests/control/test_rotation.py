"""The orientation error against scipy."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tactful.control import orientation_error

AXES = [(1, 0, 0), (0, 1, 0), (0, 0, 1), (2 / 3, -1 / 3, 2 / 3), (-0.6, 0.8, 0)]


@pytest.mark.parametrize("axis", AXES)
@pytest.mark.parametrize("angle_deg", [-350, -200, -179.9, -100, -20, -1e-4, 0, 1e-4, 20, 100, 120, 179.9, 200, 350])
def test_turns_the_shorter_way(axis: tuple[float, float, float], angle_deg: float) -> None:
    """A quaternion and its negative are one rotation: with q_w < 0 left as it is, the arm would turn the long way."""
    start = Rotation.from_euler("xyz", [0.4, -1.1, 2.5])
    target = Rotation.from_rotvec(np.radians(angle_deg) * np.array(axis)) * start
    shorter = np.radians((angle_deg + 180) % 360 - 180)
    error = orientation_error(start.as_matrix(), target.as_matrix())
    np.testing.assert_allclose(error, np.sin(shorter / 2) * np.array(axis), atol=1e-9)


def test_agrees_with_the_quaternion_of_the_paper() -> None:
    """The paper takes the vector part of Q^-1 Q_d, which is in the body; in base axes it is that, rotated by R."""
    rng = np.random.default_rng(1)
    for start, target in zip(Rotation.random(200, rng=rng), Rotation.random(200, rng=rng), strict=True):
        x, y, z, w = (start.inv() * target).as_quat()
        expected = start.apply(np.array([x, y, z]) * np.copysign(1.0, w))
        np.testing.assert_allclose(orientation_error(start.as_matrix(), target.as_matrix()), expected, atol=1e-9)


def test_half_a_turn_has_length_one() -> None:
    """At 180 deg the direction is free, but the error must not vanish or be no number."""
    error = orientation_error(np.eye(3), np.diag([-1.0, 1.0, -1.0]))
    np.testing.assert_allclose(np.abs(error), [0, 1, 0])
