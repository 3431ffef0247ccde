"""The planar arm as a robot, and its kinematics."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tactful.errors import TactfulError
from tactful.robots import Frame, Robot
from tactful.simulation.planar._config import ArmConfig

Array = NDArray[np.float64]


def planar_robot(config: ArmConfig | None = None) -> Robot:
    """Return the arm as a `Robot`: joints about z, x along the surface and y up, the joint torque measured at the link.

    Its `motor_inertia` is B_theta, so that `Dynamics(robot, motor_inertia=True)` has the M_r of the impact map.
    """
    arm = config or ArmConfig()
    length, mass = np.array(arm.length_m), np.array(arm.mass_kg)
    zero, one = np.zeros(3), np.ones(3)
    along = np.stack([length, zero, zero], axis=1)  # (3, 3) from each joint to the next
    rod = mass * length**2 / 12
    inertia = np.zeros((3, 3, 3))
    inertia[:, 1, 1] = inertia[:, 2, 2] = rod
    inertia[:, 0, 0] = 1e-3 * rod
    frames = {"tip": Frame(2, np.eye(3), along[2])}
    return Robot(
        name="planar3r",
        title="Planar arm of three elastic joints",
        source="assumed figures, in the size of a light arm",
        joint_names=("shoulder", "elbow", "wrist"),
        link_names=("upper_arm", "forearm", "hand"),
        prismatic=np.zeros(3, dtype=bool),
        rotation=np.broadcast_to(np.eye(3), (3, 3, 3)),
        translation=np.concatenate([np.zeros((1, 3)), along[:2]]),
        axis=np.broadcast_to([0.0, 0.0, 1.0], (3, 3)),
        mass=mass,
        com=along / 2,
        inertia=inertia,
        lower=-np.inf * one,
        upper=np.inf * one,
        velocity_limit=np.inf * one,
        torque_limit=np.inf * one,
        motor_inertia=np.array(arm.motor_inertia),
        stiffness=np.array(arm.stiffness_nm_rad),
        damping=np.array(arm.damping_nms_rad),
        coulomb_friction=np.array(arm.coulomb_nm),
        viscous_friction=np.array(arm.viscous_nms),
        torque_sensor="link",
        home=np.array([np.pi / 2, -np.pi / 2, -np.pi / 2]),
        frames=frames,
        tip="tip",
        gravity=np.array([0.0, -arm.gravity_m_s2, 0.0]),
    )


def absolute(q: ArrayLike) -> Array:
    """Return the angles of the links against x (..., 3) from those of the joints."""
    return np.cumsum(q, axis=-1)


def inverse_kinematics(arm: ArmConfig, pose: ArrayLike, elbow: str = "up") -> Array:
    """Return the joint angles q (..., 3) that put the tip at poses (x [m], y [m], angle [rad]) (..., 3).

    Raises:
        TactfulError: if a pose is out of reach.
    """
    x, y, angle = np.moveaxis(np.asarray(pose, dtype=np.float64), -1, 0)
    l1, l2, l3 = arm.length_m
    w_x, w_y = x - l3 * np.cos(angle), y - l3 * np.sin(angle)
    cosine = (w_x**2 + w_y**2 - l1**2 - l2**2) / (2 * l1 * l2)
    if (np.abs(cosine) > 1).any():
        worst = int(np.argmax(np.abs(np.ravel(cosine))))
        at = f"x {np.ravel(x)[worst]:.3f} m, y {np.ravel(y)[worst]:.3f} m, {np.ravel(angle)[worst]:.3f} rad"
        raise TactfulError(f"planar arm: the tip at {at} is out of reach; move the impact towards the arm")
    bend = np.arccos(cosine) * (-1.0 if elbow == "up" else 1.0)
    first = np.arctan2(w_y, w_x) - np.arctan2(l2 * np.sin(bend), l1 + l2 * np.cos(bend))
    return np.stack([first, bend, angle - first - bend], axis=-1)


def forward_kinematics(arm: ArmConfig, q: ArrayLike) -> Array:
    """Return the poses (x [m], y [m], angle [rad]) (..., 3) of the tip."""
    phi, length = absolute(q), np.array(arm.length_m)
    return np.stack([(length * np.cos(phi)).sum(-1), (length * np.sin(phi)).sum(-1), phi[..., 2]], axis=-1)


def jacobian(arm: ArmConfig, q: ArrayLike) -> Array:
    """Return the Jacobians (..., 3, 3) of the pose by the joint angles."""
    phi, length = absolute(q), np.array(arm.length_m)
    rows = np.stack([-length * np.sin(phi), length * np.cos(phi)], axis=-2)  # (..., 2, 3), by absolute angles
    rows = np.cumsum(rows[..., ::-1], axis=-1)[..., ::-1]
    return np.concatenate([rows, np.ones((*rows.shape[:-2], 1, 3))], axis=-2)


def point_jacobians(arm: ArmConfig, q: ArrayLike) -> tuple[Array, Array]:
    """Return normal and tangential Jacobians (c, 3) of the contact points against the horizontal surface."""
    J, angle = jacobian(arm, q), float(np.sum(q))
    offsets = np.array(arm.offsets_m)[:, None]  # (c, 1)
    return J[1] - offsets * np.sin(angle) * J[2], J[0] - offsets * np.cos(angle) * J[2]
