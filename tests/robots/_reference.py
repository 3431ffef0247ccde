"""Textbook formulas, written without the product's kernels, to compare with."""

import numpy as np

from tactful.robots import Robot


def rotation(axis, angle):
    """Rodrigues' formula."""
    x, y, z = axis
    K = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * K + (1 - np.cos(angle)) * K @ K


def transform(R=None, p=(0, 0, 0)):
    T = np.eye(4)
    T[:3, :3] = np.eye(3) if R is None else R
    T[:3, 3] = p
    return T


def link_poses(robot: Robot, q):
    """Pose of every link in the base, (n, 4, 4)."""
    T, poses = np.eye(4), []
    for i in range(robot.n):
        T = T @ transform(robot.rotation[i], robot.translation[i])
        if robot.prismatic[i]:
            T = T @ transform(p=robot.axis[i] * q[i])
        else:
            T = T @ transform(rotation(robot.axis[i], q[i]))
        poses.append(T)
    return np.array(poses)


def frame_pose(robot: Robot, q, name):
    """Pose of a frame in the base, (4, 4)."""
    frame = robot.frames[name]
    link = np.eye(4) if frame.link < 0 else link_poses(robot, q)[frame.link]
    return link @ transform(frame.rotation, frame.translation)


def mass_matrix_and_gravity(robot: Robot, q):
    """M = sum of m Jv^T Jv + Jw^T I Jw, with the motor inertia, and g = - sum of m Jv^T gravity."""
    n, poses = robot.n, link_poses(robot, q)
    axes = np.einsum("nij,nj->ni", poses[:, :3, :3], robot.axis)
    M, g = np.diag(robot.motor_inertia), np.zeros(n)
    for k in range(n):
        R = poses[k, :3, :3]
        com = R @ robot.com[k] + poses[k, :3, 3]
        Jv, Jw = np.zeros((3, n)), np.zeros((3, n))
        for i in range(k + 1):
            if robot.prismatic[i]:
                Jv[:, i] = axes[i]
            else:
                Jv[:, i], Jw[:, i] = np.cross(axes[i], com - poses[i, :3, 3]), axes[i]
        M = M + robot.mass[k] * Jv.T @ Jv + Jw.T @ R @ robot.inertia[k] @ R.T @ Jw
        g -= robot.mass[k] * Jv.T @ robot.gravity
    return M, g


def dh(a, alpha, d, theta):
    """Standard Denavit-Hartenberg transform."""
    return transform(rotation((0, 0, 1), theta), (0, 0, d)) @ transform(rotation((1, 0, 0), alpha), (a, 0, 0))


def craig(a, alpha, d, theta):
    """Modified (Craig) Denavit-Hartenberg transform."""
    return transform(rotation((1, 0, 0), alpha), (a, 0, 0)) @ transform(rotation((0, 0, 1), theta), (0, 0, d))
