"""An arm as one flat record, the form in which the kernels read it."""

from __future__ import annotations

import functools
from typing import Any

import numpy as np

from tactful.robots import Robot

Record = np.ndarray[tuple[int], np.dtype[np.void]]
"""A structured array of length one: numba reads and writes its fields in place; it copies and pickles as one block."""


@functools.cache
def arm_dtype(n: int) -> np.dtype[np.void]:
    """Return the layout of an arm with n joints."""
    return np.dtype(
        [
            # Rotation from link i to link i - 1: rotation_0 + sin(q) rotation_sin + (1 - cos(q)) rotation_cos.
            ("rotation_0", "f8", (n, 3, 3)),
            ("rotation_sin", "f8", (n, 3, 3)),
            ("rotation_cos", "f8", (n, 3, 3)),
            ("translation", "f8", (n, 3)),  # at q = 0, in link i - 1 [m]
            ("axis", "f8", (n, 3)),  # in link i
            ("prismatic", "i8", (n,)),
            ("mass", "f8", (n,)),  # [kg]
            ("first_moment", "f8", (n, 3)),  # mass * com, in link i [kg m]
            ("inertia", "f8", (n, 3, 3)),  # about the origin of link i [kg m^2]
            ("motor_inertia", "f8", (n,)),  # moving with the torque sensor's side [kg m^2]
            ("gravity", "f8", (3,)),  # in the base [m/s^2]
            ("tip_link", "i8"),
            ("tip_translation", "f8", (3,)),  # in the tip's link [m]
        ],
        align=True,
    )


@functools.cache
def motion_dtype(n: int) -> np.dtype[np.void]:
    """Return the layout of what the passes over an arm with n joints leave behind."""
    return np.dtype(
        [
            ("E", "f8", (n, 3, 3)),  # rotation from link i to link i - 1
            ("d", "f8", (n, 3)),  # origin of link i in link i - 1 [m]
            ("R", "f8", (n, 3, 3)),  # rotation from link i to the base
            ("o", "f8", (n, 3)),  # origin of link i in the base [m]
            ("z", "f8", (n, 3)),  # axis of joint i in the base
            ("w", "f8", (n, 3)),  # angular velocity of link i, in link i [rad/s]
            ("v", "f8", (n, 3)),  # velocity of the origin of link i, in link i [m/s]
            ("a", "f8", (n, 3)),  # gravity, or acceleration of the origin, in link i [m/s^2]
            ("dw", "f8", (n, 3)),  # angular acceleration of link i, in link i [rad/s^2]
            ("k", "f8", (n, 3)),  # angular momentum, or moment, of the subtree of link i about its origin
            ("l", "f8", (n, 3)),  # linear momentum, or force, of the subtree of link i
            ("gk", "f8", (n, 3)),  # moment of gravity on the subtree of link i about its origin [Nm]
            ("gl", "f8", (n, 3)),  # gravity force on the subtree of link i [N]
            ("p", "f8", (n,)),  # generalized momentum M dq
            ("ctdq", "f8", (n,)),  # C^T dq
            ("g", "f8", (n,)),  # gravity torque
            ("Im", "f8", (n,)),  # mass, first moment and inertia of the composite body from link i on
            ("Ih", "f8", (n, 3)),
            ("II", "f8", (n, 3, 3)),
            ("turned", "f8", (3, 3)),
        ],
        align=True,
    )


def arm_record(robot: Robot, *, motor_inertia: bool | None = None) -> Record:
    """Return the arm as the kernels read it.

    Args:
        robot: the arm.
        motor_inertia: whether the inertia of the motors counts. It does where the torque is measured before the gear
            (currents) and does not where it is measured behind it (joint torque sensors): the default is what
            `robot.torque_sensor` says.
    """
    n = len(robot.joint_names)
    record: Any = np.zeros(1, arm_dtype(n))
    arm = record[0]
    x, y, z = robot.axis.T
    zero = np.zeros(n)
    skew = np.array([[zero, -z, y], [z, zero, -x], [-y, x, zero]]).transpose(2, 0, 1)  # (n, 3, 3)
    turning = ~np.asarray(robot.prismatic)[:, None, None]
    arm["rotation_0"] = robot.rotation
    arm["rotation_sin"] = robot.rotation @ skew * turning
    arm["rotation_cos"] = robot.rotation @ skew @ skew * turning
    arm["translation"] = robot.translation
    arm["axis"] = robot.axis
    arm["prismatic"] = robot.prismatic
    arm["mass"] = robot.mass
    arm["first_moment"] = robot.mass[:, None] * robot.com
    c = robot.com
    steiner = np.einsum("ij,ij->i", c, c)[:, None, None] * np.eye(3) - c[:, :, None] * c[:, None, :]
    arm["inertia"] = robot.inertia + robot.mass[:, None, None] * steiner
    if motor_inertia or (motor_inertia is None and robot.torque_sensor == "motor"):
        arm["motor_inertia"] = robot.motor_inertia
    arm["gravity"] = robot.gravity
    tip = robot.frames[robot.tip]
    arm["tip_link"] = tip.link
    arm["tip_translation"] = tip.translation
    return record  # type: ignore[no-any-return]


def motion_record(n: int) -> Record:
    """Return room for the passes over an arm with n joints."""
    return np.zeros(1, motion_dtype(n))
