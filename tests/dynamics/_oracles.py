"""Arms made by hand, and the same arm in Pinocchio (from the robot's figures) and in MuJoCo (from its MJCF)."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import mujoco
import numpy as np
import pytest
from numpy.typing import NDArray

from tactful.robots import Frame, Robot

pinocchio = pytest.importorskip("pinocchio", reason="Pinocchio has no wheel for this platform")

Array = NDArray[np.float64]


def random_rotation(rng: np.random.Generator) -> Array:
    Q = np.linalg.qr(rng.standard_normal((3, 3)))[0]
    return np.asarray(Q * np.sign(np.linalg.det(Q)))


def random_inertia(rng: np.random.Generator, mass: float) -> Array:
    """The inertia of a box of random size and attitude."""
    x, y, z = rng.uniform(0.05, 0.4, 3) ** 2
    R = random_rotation(rng)
    return np.asarray(R @ np.diag([y + z, x + z, x + y]) @ R.T * mass / 12)


def make_arm(prismatic: str, rng: np.random.Generator, **figures: Any) -> Robot:
    """An arm with a joint for every letter, P or R; all that is not given is random, the axes askew."""
    n = len(prismatic)
    axis = rng.standard_normal((n, 3))
    mass = rng.uniform(0.5, 5.0, n)
    random = {
        "rotation": [random_rotation(rng) for _ in range(n)],
        "translation": rng.uniform(-0.4, 0.4, (n, 3)),
        "axis": axis / np.linalg.norm(axis, axis=1, keepdims=True),
        "mass": mass,
        "com": rng.uniform(-0.2, 0.2, (n, 3)),
        "inertia": [random_inertia(rng, m) for m in mass],
        "motor_inertia": rng.uniform(0.1, 0.5, n),
        "frames": {"tip": Frame(n - 1, random_rotation(rng), rng.uniform(-0.2, 0.2, 3))},
        "gravity": rng.uniform(-10, 10, 3),
    }
    unknown = np.full(n, np.nan)
    unlimited = np.full(n, np.inf)
    return Robot(
        **{  # type: ignore[arg-type]
            "name": f"random {prismatic}",
            "title": "Random arm",
            "source": "a random generator",
            "joint_names": tuple(f"joint{i}" for i in range(n)),
            "link_names": tuple(f"link{i}" for i in range(n)),
            "prismatic": np.array([letter == "P" for letter in prismatic]),
            "lower": -unlimited,
            "upper": unlimited,
            "velocity_limit": unlimited,
            "torque_limit": unlimited,
            "stiffness": unknown,
            "damping": unknown,
            "coulomb_friction": np.zeros(n),
            "viscous_friction": np.zeros(n),
            "torque_sensor": "link",
            "home": np.zeros(n),
            "tip": "tip",
        }
        | random
        | figures
    )


def states(robot: Robot, count: int, seed: int = 0) -> Iterator[tuple[Array, Array, Array]]:
    """Positions [rad or m], velocities and accelerations, far beyond what an arm does."""
    rng = np.random.default_rng(seed)
    for _ in range(count):
        yield rng.uniform(-np.pi, np.pi, robot.n), rng.uniform(-3, 3, robot.n), rng.uniform(-10, 10, robot.n)


class PinocchioArm:
    """The arm in Pinocchio, put together from the figures of the robot."""

    def __init__(self, robot: Robot, *, motor_inertia: bool) -> None:
        model = self.model = pinocchio.Model()
        for i in range(robot.n):
            kind = "JointModelPrismaticUnaligned" if robot.prismatic[i] else "JointModelRevoluteUnaligned"
            joint = getattr(pinocchio, kind)(robot.axis[i].copy())
            place = pinocchio.SE3(robot.rotation[i].copy(), robot.translation[i].copy())
            model.addJoint(i, joint, place, robot.joint_names[i])
            self.append(i, robot.mass[i], robot.com[i], robot.inertia[i])
        if motor_inertia:
            model.armature = robot.motor_inertia.copy()
        model.gravity.linear = robot.gravity.copy()
        self.data = model.createData()

    def append(self, link: int, mass: float, com: Array, inertia: Array, frame: Frame | None = None) -> None:
        """Fix a body to a link."""
        at = pinocchio.SE3.Identity()
        if frame is not None:
            at = pinocchio.SE3(np.array(frame.rotation), np.array(frame.translation))
        self.model.appendBodyToJoint(link + 1, pinocchio.Inertia(float(mass), np.array(com), np.array(inertia)), at)

    def mass_matrix(self, q: Array) -> Array:
        M = pinocchio.crba(self.model, self.data, q)
        return np.array(np.triu(M) + np.triu(M, 1).T)

    def coriolis(self, q: Array, dq: Array) -> Array:
        return np.array(pinocchio.computeCoriolisMatrix(self.model, self.data, q, dq))

    def gravity(self, q: Array) -> Array:
        return np.array(pinocchio.computeGeneralizedGravity(self.model, self.data, q))

    def inverse_dynamics(self, q: Array, dq: Array, ddq: Array) -> Array:
        return np.array(pinocchio.rnea(self.model, self.data, q, dq, ddq))

    def jacobian(self, q: Array, link: int, point: Array) -> Array:
        pinocchio.computeJointJacobians(self.model, self.data, q)
        J = pinocchio.getJointJacobian(self.model, self.data, link + 1, pinocchio.LOCAL_WORLD_ALIGNED)
        arm = np.asarray(point - self.data.oMi[link + 1].translation)
        return np.concatenate([J[:3] - np.cross(arm, J[3:], axis=0), J[3:]])


class MujocoArm:
    """The arm in MuJoCo, from its MJCF."""

    def __init__(self, robot: Robot, *, motor_inertia: bool) -> None:
        self.robot = robot if motor_inertia else replace(robot, motor_inertia=np.zeros(robot.n))
        self.model = mujoco.MjModel.from_xml_string(self.robot.to_mjcf())
        self.data = mujoco.MjData(self.model)

    def place(self, q: Array, dq: Array) -> None:
        self.data.qpos, self.data.qvel = q, dq
        mujoco.mj_fwdPosition(self.model, self.data)
        mujoco.mj_fwdVelocity(self.model, self.data)

    def mass_matrix(self) -> Array:
        M = np.empty((self.model.nv, self.model.nv))
        mujoco.mj_fullM(self.model, self.data, M)
        return M

    def jacobian(self, link: int, point: Array) -> Array:
        J = np.empty((6, self.model.nv))
        body = self.model.body(self.robot.link_names[link]).id
        mujoco.mj_jac(self.model, self.data, J[:3], J[3:], point, body)
        return J
