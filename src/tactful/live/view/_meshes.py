"""The surface of each link: meshes where the arm's file has them, capsules otherwise."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np

from tactful.live.view._messages import Array
from tactful.robots import Robot


class Surface(NamedTuple):
    """Triangles in the frame of a link."""

    vertices: Array
    """(v, 3) [m]."""
    faces: Array
    """(f, 3), indices of vertices."""


def surfaces(robot: Robot, model: str | None) -> dict[int, Surface]:
    """Return the surface of each link that has one, by its index; -1 is the base."""
    if model is not None and Path(model).is_file():
        found = _from_file(robot, model)
        if found:
            return found
    return _from_capsules(robot)


def _from_capsules(robot: Robot) -> dict[int, Surface]:
    import trimesh

    parts: dict[int, list[Surface]] = {}
    for capsule in robot.capsules:
        axis = capsule.p1_m - capsule.p0_m
        length = float(np.linalg.norm(axis))
        if length < 1e-6:
            mesh = trimesh.creation.icosphere(subdivisions=3, radius=capsule.radius_m)
            middle = capsule.p0_m
            turn = np.eye(3)
        else:
            mesh = trimesh.creation.capsule(height=length, radius=capsule.radius_m, count=[28, 28])
            mesh.apply_translation([0, 0, -mesh.bounds.mean(axis=0)[2]])
            middle = (capsule.p0_m + capsule.p1_m) / 2
            turn = _turn_z_to(axis / length)
        vertices = np.asarray(mesh.vertices) @ turn.T + middle
        parts.setdefault(capsule.link, []).append(Surface(vertices, np.asarray(mesh.faces)))
    return {link: _joined(found) for link, found in parts.items()}


def _from_file(robot: Robot, model: str) -> dict[int, Surface]:
    """Return what the file's meshes look like; nothing if MuJoCo is not there, or does not read them."""
    try:
        import mujoco

        world = mujoco.MjModel.from_xml_path(model)
    except (ImportError, ValueError):
        return {}
    data = mujoco.MjData(world)
    for name, q in zip(robot.joint_names, robot.home, strict=True):
        joint = mujoco.mj_name2id(world, mujoco.mjtObj.mjOBJ_JOINT, name)
        if joint < 0:
            return {}
        data.qpos[world.jnt_qposadr[joint]] = q
    mujoco.mj_kinematics(world, data)
    placed = link_poses(robot, robot.home)
    joints = [mujoco.mj_name2id(world, mujoco.mjtObj.mjOBJ_JOINT, name) for name in robot.joint_names]
    bodies = [int(world.jnt_bodyid[joint]) for joint in joints]
    base_R, base_x = _base(world, data, joints[0], bodies[0], robot)
    parts: dict[int, list[Surface]] = {}
    for geom in range(world.ngeom):
        if world.geom_type[geom] != mujoco.mjtGeom.mjGEOM_MESH or world.geom_group[geom] > 2:
            continue
        body = int(world.geom_bodyid[geom])
        while body and body not in bodies:
            body = int(world.body_parentid[body])
        link = bodies.index(body) if body else -1
        number = int(world.geom_dataid[geom])
        start, count = int(world.mesh_vertadr[number]), int(world.mesh_vertnum[number])
        first, faces = int(world.mesh_faceadr[number]), int(world.mesh_facenum[number])
        in_world = world.mesh_vert[start : start + count] @ data.geom_xmat[geom].reshape(3, 3).T + data.geom_xpos[geom]
        in_base = (in_world - base_x) @ base_R
        R, x = placed[link] if link >= 0 else (np.eye(3), np.zeros(3))
        surface = Surface((in_base - x) @ R, np.array(world.mesh_face[first : first + faces]))
        parts.setdefault(link, []).append(surface)
    return {link: _joined(found) for link, found in parts.items()}


def _base(world: object, data: object, joint: int, body: int, robot: Robot) -> tuple[Array, Array]:
    """Return the pose of the arm's base in the file's world: its first link stands in both."""
    R, x = link_poses(robot, robot.home)[0]
    R_world = data.xmat[body].reshape(3, 3)  # type: ignore[attr-defined]
    anchor = data.xanchor[joint]  # type: ignore[attr-defined]
    rotation = R_world @ R.T
    return rotation, anchor - rotation @ x


def link_poses(robot: Robot, q: Array) -> list[tuple[Array, Array]]:
    """Return the rotation (3, 3) and the origin (3,) [m] of each link in the base, at q (n,) [rad]."""
    from tactful.dynamics import arm_record, kernels, motion_record

    arm, motion = arm_record(robot)[0], motion_record(robot.n)[0]
    kernels.place(arm, motion, np.asarray(q, dtype=np.float64))
    return [(motion["R"][i].copy(), motion["o"][i].copy()) for i in range(robot.n)]


def _joined(parts: list[Surface]) -> Surface:
    offsets = np.cumsum([0, *(len(part.vertices) for part in parts[:-1])])
    faces = [part.faces + offset for part, offset in zip(parts, offsets, strict=True)]
    return Surface(np.concatenate([part.vertices for part in parts]), np.concatenate(faces))


def _turn_z_to(axis: Array) -> Array:
    """Return a rotation that takes z to a unit vector (3,)."""
    from scipy.spatial.transform import Rotation

    return np.asarray(Rotation.align_vectors([axis], [[0.0, 0.0, 1.0]])[0].as_matrix())
