"""Frames and capsules that are fixed to links, and the rotations between them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from tactful.robots._errors import RobotError
from tactful.robots._frozen import Array, FrozenRecord, frozen_array


@dataclass(frozen=True, eq=False)
class Frame(FrozenRecord):
    """A frame fixed to a link: a point p of the frame is `rotation @ p + translation` in the link's frame.

    Attributes:
        link: Index of the link, -1 for the base.
        rotation: (3, 3) axes of the frame, as columns, in the link's frame.
        translation: (3,) [m] its origin in the link's frame.
    """

    link: int
    rotation: Array
    translation: Array

    def __post_init__(self) -> None:
        for field, shape in (("rotation", (3, 3)), ("translation", (3,))):
            array = frozen_array(getattr(self, field))
            object.__setattr__(self, field, array)
            if array.shape != shape or not np.isfinite(array).all():
                raise RobotError("frame", field, f"must be {shape} finite numbers, not {array.tolist()}")
        if not is_rotation(self.rotation):
            raise RobotError("frame", "rotation", f"is not a rotation matrix: {self.rotation.tolist()}")


@dataclass(frozen=True, eq=False)
class Capsule(FrozenRecord):
    """A part of a link's surface: all points within `radius_m` of the segment from `p0_m` to `p1_m` (equal: a sphere).

    Attributes:
        link: Index of the link, -1 for the base.
        p0_m: (3,) [m] one end of the segment in the link's frame.
        p1_m: (3,) [m] the other end.
        radius_m: [m].
    """

    link: int
    p0_m: Array
    p1_m: Array
    radius_m: float

    def __post_init__(self) -> None:
        for field in ("p0_m", "p1_m"):
            array = frozen_array(getattr(self, field))
            object.__setattr__(self, field, array)
            if array.shape != (3,) or not np.isfinite(array).all():
                raise RobotError("capsule", field, f"must be 3 finite numbers, not {array.tolist()}")
        if not (np.isfinite(self.radius_m) and self.radius_m > 0):
            raise RobotError("capsule", "radius_m", f"must be positive, not {self.radius_m}")


def is_rotation(rotation: Array) -> bool:
    """Whether (..., 3, 3) matrices are orthonormal and right-handed to 1e-9."""
    gram = rotation @ np.swapaxes(rotation, -1, -2)  # (..., 3, 3)
    return bool(np.allclose(gram, np.eye(3), rtol=0, atol=1e-9) and (np.linalg.det(rotation) > 0).all())


def rotation_from_rpy(rpy: ArrayLike) -> Array:
    """Rotation of roll, pitch, yaw [rad] about fixed axes: R = Rz(yaw) Ry(pitch) Rx(roll), as in URDF.

    Entries below 1e-15 are set to zero, so that quarter turns are exact.
    """
    (cr, cp, cy), (sr, sp, sy) = np.cos(rpy), np.sin(rpy)
    rotation: Array = np.array(
        [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]
    )
    rotation[np.abs(rotation) < 1e-15] = 0.0
    return rotation


def rotation_about(axis: Array, angle: float) -> Array:
    """Rotation by `angle` [rad] about the unit vector `axis` (Rodrigues)."""
    x, y, z = axis
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.asarray(np.eye(3) + np.sin(angle) * cross + (1.0 - np.cos(angle)) * cross @ cross)


def rotation_from_quaternion(wxyz: ArrayLike) -> Array:
    """Rotation of the quaternion (w, x, y, z), which is normalised first."""
    w, x, y, z = np.asarray(wxyz, dtype=np.float64) / np.linalg.norm(wxyz)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def quaternion_from_rotation(rotation: Array) -> Array:
    """Unit quaternion (w, x, y, z) of a rotation, by its largest component (Shepperd), so that no digit is lost."""
    trace = np.trace(rotation)
    squares = np.array([1 + trace, *(1 - trace + 2 * np.diag(rotation))])  # 4 w^2, 4 x^2, 4 y^2, 4 z^2
    a, b, c = rotation[2, 1] - rotation[1, 2], rotation[0, 2] - rotation[2, 0], rotation[1, 0] - rotation[0, 1]
    d, e, f = rotation[0, 1] + rotation[1, 0], rotation[0, 2] + rotation[2, 0], rotation[1, 2] + rotation[2, 1]
    products = np.array([[squares[0], a, b, c], [a, squares[1], d, e], [b, d, squares[2], f], [c, e, f, squares[3]]])
    quaternion = products[np.argmax(squares)]
    return np.asarray(quaternion / np.linalg.norm(quaternion))
