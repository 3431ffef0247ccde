"""Inertial parameters of links that stay physically consistent whatever a fit does to them."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tactful.robots import Robot

Array = NDArray[np.float64]

PARAMETERS = 10
"""Of a link: mass, first moment (3) and the inertia about the link's origin xx, xy, xz, yy, yz, zz."""
_PAIRS = ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2))
_OFF_DIAGONAL = np.triu_indices(4, 1)
_FLOOR = 1e-9
"""Least eigenvalue of a scaled pseudo-inertia: figures on the border of what a body can have are moved inside."""


def parameters_of(mass: float, com: Array, inertia: Array) -> Array:
    """Return the parameters (10,) of a body from its inertia about the centre of mass (3, 3)."""
    about_origin = inertia + mass * (com @ com * np.eye(3) - np.outer(com, com))  # (3, 3)
    return np.array([mass, *(mass * com), *(about_origin[i, j] for i, j in _PAIRS)])


def body_of(parameters: Array) -> tuple[float, Array, Array]:
    """Return mass, centre of mass (3,) and the inertia about it (3, 3)."""
    mass = float(parameters[0])
    com = parameters[1:4] / mass
    inertia = np.empty((3, 3))
    for value, (i, j) in zip(parameters[4:], _PAIRS, strict=True):
        inertia[i, j] = inertia[j, i] = value
    return mass, com, inertia - mass * (com @ com * np.eye(3) - np.outer(com, com))


def _pseudo(parameters: Array) -> Array:
    """Return the pseudo-inertia (4, 4): [[tr(I) / 2 - I, h], [h^T, m]]; it is linear in the parameters."""
    inertia = np.empty((3, 3))
    for value, (i, j) in zip(parameters[4:], _PAIRS, strict=True):
        inertia[i, j] = inertia[j, i] = value
    P = np.empty((4, 4))
    P[:3, :3] = 0.5 * np.trace(inertia) * np.eye(3) - inertia
    P[:3, 3] = P[3, :3] = parameters[1:4]
    P[3, 3] = parameters[0]
    return P


def _parameters(P: Array) -> Array:
    """Return the parameters (..., 10) of pseudo-inertias (..., 4, 4)."""
    second = P[..., :3, :3]
    inertia = np.trace(second, axis1=-2, axis2=-1)[..., None, None] * np.eye(3) - second
    return np.concatenate(
        [P[..., 3:, 3], P[..., :3, 3], np.stack([inertia[..., i, j] for i, j in _PAIRS], axis=-1)], axis=-1
    )


class LinkChart:
    r"""Coordinates x (10,) of a body about a nominal one, every one of which is a body that can exist.

    A body is physically consistent if and only if its pseudo-inertia P is positive definite. With the nominal
    P_0 = U_0 U_0^T,

        P(x) = U_0 L(x) L(x)^T U_0^T,    L upper triangular, diagonal exp(x_0..3), x_4..9 above it,

    so x = 0 is the nominal body. For small x, 4 \sum x_0..3^2 + 2 \sum x_4..9^2 is the squared distance of P from P_0
    in the affine-invariant metric, which depends on no choice of units or frames: `scale` is x for a distance of one.

    Source: the log-Cholesky coordinates of C. Rucker, P. Wensing, "Smooth parameterization of rigid-body inertia",
    RA-L 2022, doi:10.1109/LRA.2022.3144517, taken about the nominal body; the metric from T. Lee, F. C. Park, "A
    geometric algorithm for robust multibody inertial parameter identification", RA-L 2018,
    doi:10.1109/LRA.2018.2799426.

    Args:
        parameters: of the nominal body (10,).
    """

    scale: Array = np.array([0.5] * 4 + [np.sqrt(0.5)] * 6)

    def __init__(self, parameters: Array) -> None:
        self.nominal = parameters
        P = _pseudo(parameters)
        size = np.sqrt(np.abs(np.diag(P)) + _FLOOR * np.abs(P).max())
        values, vectors = np.linalg.eigh(P / np.outer(size, size))
        self._root = size[:, None] * vectors * np.sqrt(np.maximum(values, _FLOOR))  # (4, 4)

    def __call__(self, x: Array) -> tuple[Array, Array]:
        """Return the parameters (10,) at x (10,) and their derivative (10, 10)."""
        L = np.diag(np.exp(x[:4]))
        L[_OFF_DIAGONAL] = x[4:]
        dL = np.zeros((PARAMETERS, 4, 4))
        dL[np.arange(4), np.arange(4), np.arange(4)] = np.exp(x[:4])
        dL[np.arange(4, PARAMETERS), *_OFF_DIAGONAL] = 1.0
        half = dL @ L.T
        P = self._root @ L @ L.T @ self._root.T
        dP = self._root @ (half + half.transpose(0, 2, 1)) @ self._root.T
        return _parameters(P), _parameters(dP).T


def robot_parameters(robot: Robot) -> Array:
    """Return the parameters of all links (n, 10)."""
    return np.array([parameters_of(robot.mass[i], robot.com[i], robot.inertia[i]) for i in range(robot.n)])


def with_parameters(robot: Robot, parameters: Array, motor_inertia: Array | None = None) -> Robot:
    """Return the arm with other inertial parameters (n, 10), and other inertias of the motors (n,)."""
    mass, com, inertia = zip(*(body_of(row) for row in parameters), strict=True)
    changed: dict[str, Any] = {"mass": np.array(mass), "com": np.array(com), "inertia": np.array(inertia)}
    if motor_inertia is not None:
        changed["motor_inertia"] = motor_inertia
    return replace(robot, **changed)
