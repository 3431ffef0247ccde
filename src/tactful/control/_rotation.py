"""The error between two orientations."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tactful._njit import njit

Array = NDArray[np.float64]


@njit(cache=True)
def quaternion_error(R: Array, R_d: Array, E: Array, error: Array) -> None:
    """Set error (3,) to the vector part of the quaternion of R_d R^T, with q_w >= 0; E (3, 3) is scratch.

    R_d R^T is the rotation from R to R_d in base axes, whose vector part is that of R^T R_d rotated into the base.
    """
    for r in range(3):
        for c in range(3):
            E[r, c] = R_d[r, 0] * R[c, 0] + R_d[r, 1] * R[c, 1] + R_d[r, 2] * R[c, 2]
    trace = E[0, 0] + E[1, 1] + E[2, 2]
    if trace > 0.0:
        scale = 0.5 / np.sqrt(1.0 + trace)
        error[0] = scale * (E[2, 1] - E[1, 2])
        error[1] = scale * (E[0, 2] - E[2, 0])
        error[2] = scale * (E[1, 0] - E[0, 1])
        return
    i = 0  # beyond 120 deg the largest component of the vector part comes first (Shepperd), so that no digit is lost
    for k in range(1, 3):
        if E[k, k] > E[i, i]:
            i = k
    j, k = (i + 1) % 3, (i + 2) % 3
    largest = 0.5 * np.sqrt(max(1.0 + E[i, i] - E[j, j] - E[k, k], 0.0))
    error[i] = largest
    error[j] = 0.25 * (E[j, i] + E[i, j]) / largest
    error[k] = 0.25 * (E[k, i] + E[i, k]) / largest
    if E[k, j] < E[j, k]:  # q_w < 0
        for r in range(3):
            error[r] = -error[r]


def orientation_error(rotation: ArrayLike, target: ArrayLike) -> Array:
    r"""Return how the orientation has to turn to reach its target, as a vector (3,) in base axes.

    \Delta\varepsilon = sin(\theta / 2) u for the shorter rotation by \theta about the unit vector u: the vector part of
    the quaternion of R_d R^T with q_w >= 0. For small rotations it is half the angle.

    Args:
        rotation: the orientation R (3, 3).
        target: the orientation R_d (3, 3).
    """
    error: Any = np.empty(3)
    R, R_d = (np.ascontiguousarray(matrix, dtype=np.float64) for matrix in (rotation, target))
    quaternion_error(R, R_d, np.empty((3, 3)), error)
    return error  # type: ignore[no-any-return]
