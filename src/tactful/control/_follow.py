"""Where an arm will be, without simulating it."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from tactful.control._config import ImpedanceConfig
from tactful.control._path import Pose
from tactful.control._rotation import orientation_error
from tactful.dynamics import Dynamics
from tactful.errors import TactfulError
from tactful.robots import Robot

Array = NDArray[np.float64]

FOLLOW_STEP_S = 0.02
_NEAR_M = 1e-4


def follow(
    robot: Robot, reference: Callable[[float], Pose], q: Array, duration_s: float, config: ImpedanceConfig
) -> Array:
    """Return how the arm follows a reference in free motion, every 20 ms (k, n) [rad].

    Inertia is left out, so that spring and damper balance: B J dq = K [dp, de], with the posture in the rest of dq.

    Args:
        robot: the arm.
        reference: the pose that the tip should have at the time t [s].
        q: joint positions at the start, which are the posture too (n,) [rad].
        duration_s: for how long [s].
        config: the impedance.
    """
    dynamics = Dynamics(robot)
    K = np.repeat([config.stiffness_n_m, config.stiffness_nm_rad], 3)
    B = np.repeat(config.damping, 3)
    posture = config.posture_stiffness_nm_rad / config.posture_damping_nms_rad
    path = [q]
    for k in range(round(duration_s / FOLLOW_STEP_S)):
        now = path[-1]
        dq = _towards(dynamics, now, reference(k * FOLLOW_STEP_S), K / B, posture * (q - now))
        path.append(now + FOLLOW_STEP_S * dq)
    return np.array(path)


def reach(robot: Robot, pose: Pose, q: Array) -> Array:
    """Return joint positions (n,) [rad] near q that bring the tip to a pose.

    Raises:
        TactfulError: if the pose cannot be reached within the joints' range.
    """
    dynamics = Dynamics(robot)
    near = q.copy()
    for _ in range(200):
        near = near + 0.3 * _towards(dynamics, near, pose, np.array([1.0, 1, 1, 2, 2, 2]), 0.1 * (q - near))
        near = np.clip(near, robot.lower + 0.02, robot.upper - 0.02)
    if np.linalg.norm(dynamics.pose(near)[1] - pose.position_m) > 10 * _NEAR_M:
        raise TactfulError(f"{robot.name} cannot reach {np.round(pose.position_m, 3).tolist()} m in that orientation")
    return near


def _towards(dynamics: Dynamics, q: Array, pose: Pose, rate: Array, spare: Array) -> Array:
    """Return the joint velocity (n,) that closes the error to a pose at a rate (6,), with `spare` where it is free."""
    rotation, position = dynamics.pose(q)
    error = np.concatenate([pose.position_m - position, orientation_error(rotation, pose.rotation)])
    J = dynamics.jacobian(q)
    inverse = J.T @ np.linalg.inv(J @ J.T + 1e-6 * np.eye(6))
    return np.asarray(inverse @ (rate * error) + spare - inverse @ (J @ spare))
