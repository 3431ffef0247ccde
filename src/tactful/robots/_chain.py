"""Take the serial chain to a tip out of a compiled MuJoCo model."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from tactful.robots._errors import RobotFileError, UnknownFrameError
from tactful.robots._frozen import Array
from tactful.robots._geometry import Capsule, Frame, rotation_about, rotation_from_quaternion
from tactful.robots._inertia import joined_inertia
from tactful.robots._robot import Robot

_FREE, _BALL, _SLIDE, _HINGE = range(4)  # mjtJoint
_SPHERE, _CAPSULE, _CYLINDER, _BOX = 2, 3, 5, 6  # mjtGeom
_TRANSMISSION_JOINT = 0  # mjtTrn
_TIPS = ("tip", "attachment_site")


@dataclass(frozen=True)
class Overrides:
    """What a URDF says beyond the model: by joint name, and the name of the root link, which MuJoCo makes the world."""

    root: str = ""
    velocity_limit: Mapping[str, float] = field(default_factory=dict)
    torque_limit: Mapping[str, float] = field(default_factory=dict)
    mimics: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class _Pose:
    rotation: Array
    translation: Array

    def __matmul__(self, other: _Pose) -> _Pose:
        return _Pose(self.rotation @ other.rotation, self.rotation @ other.translation + self.translation)

    def inverse(self) -> _Pose:
        return _Pose(self.rotation.T, -self.rotation.T @ self.translation)


_IDENTITY = _Pose(np.eye(3), np.zeros(3))


def robot_from_model(model: Any, path: Path, name: str, tip: str | None, overrides: Overrides) -> Robot:
    """The chain from the body that carries the first joint to the tip, as a robot.

    Bodies that no joint of the chain moves are the base; all others are lumped into the link that carries them, joints
    off the chain standing as the file draws them.
    """
    bodies = [_label(model.body(b).name, b, overrides) for b in range(model.nbody)]
    sites = [model.site(s).name for s in range(model.nsite)]
    tip_name, tip_body = _find_tip(model, path, name, tip, bodies, sites)
    chain = _chain(model, path, tip_body, bodies, overrides)
    joints = [int(model.body_jntadr[b]) for b in chain]
    labels = [_label(model.joint(j).name, j, kind="joint") for j in joints]
    tree = _Tree.of(model, chain)
    rotation, translation = _link_poses(model, chain, tree)
    mass, com, inertia = _link_inertias(model, len(chain), tree)
    limited = model.jnt_limited[joints].astype(bool)
    lower = np.where(limited, model.jnt_range[joints, 0], -np.inf)
    upper = np.where(limited, model.jnt_range[joints, 1], np.inf)
    torque_limit = np.array([_torque_limit(model, j) for j in joints])
    dofs = model.jnt_dofadr[joints]
    return Robot(
        name=name,
        title=name,
        source=str(path),
        joint_names=tuple(labels),
        link_names=tuple(bodies[b] for b in chain),
        prismatic=model.jnt_type[joints] == _SLIDE,
        rotation=rotation,
        translation=translation,
        axis=model.jnt_axis[joints],
        mass=mass,
        com=com,
        inertia=inertia,
        lower=lower,
        upper=upper,
        velocity_limit=np.array([overrides.velocity_limit.get(label, np.inf) for label in labels]),
        torque_limit=np.minimum(torque_limit, [overrides.torque_limit.get(label, np.inf) for label in labels]),
        motor_inertia=model.dof_armature[dofs],
        stiffness=np.full(len(chain), np.nan),
        damping=np.full(len(chain), np.nan),
        coulomb_friction=model.dof_frictionloss[dofs],
        viscous_friction=model.dof_damping[dofs].reshape(len(chain), -1)[:, 0],
        torque_sensor="link",
        home=np.clip(_home(model)[model.jnt_qposadr[joints]], lower, upper),
        frames=_frames(model, bodies, sites, tree),
        tip=tip_name,
        gravity=tree.to_base.rotation @ model.opt.gravity,
        capsules=_capsules(model, tree),
    )


@dataclass(frozen=True)
class _Tree:
    """Which link carries each body of the model, and where."""

    base: int  # the body that carries the first link
    owner: list[int]  # of each body: its link, -1 if it is not moved by the chain
    rigid: list[bool]  # of each body: no joint off the chain between it and its link
    pose: list[_Pose]  # of each body in its link's frame, in the base frame where the owner is -1
    to_base: _Pose  # of the world in the base frame

    @classmethod
    def of(cls, model: Any, chain: list[int]) -> _Tree:
        base = int(model.body_parentid[chain[0]])
        owner, rigid, pose = [-1], [True], [_IDENTITY]
        for b in range(1, model.nbody):
            parent = int(model.body_parentid[b])
            if b in chain:
                owner.append(chain.index(b))
                rigid.append(True)
                pose.append(_Pose(np.eye(3), -_anchor(model, b)))
            else:
                owner.append(owner[parent])
                rigid.append(rigid[parent] and model.body_jntnum[b] == 0)
                pose.append(pose[parent] @ _placed(model.body_pos[b], model.body_quat[b]))
        to_base = pose[base].inverse()
        return cls(base, owner, rigid, [to_base @ p if o < 0 else p for p, o in zip(pose, owner, strict=True)], to_base)


def _anchor(model: Any, body: int) -> Array:
    """A point on the body's joint axis, in the body's frame: the origin of its link."""
    joint = int(model.body_jntadr[body])
    return np.array(model.jnt_pos[joint]) if model.jnt_type[joint] == _HINGE else np.zeros(3)


def _link_poses(model: Any, chain: list[int], tree: _Tree) -> tuple[Array, Array]:
    """Rotation (n, 3, 3) and translation (n, 3) of each link in the one before it, at q = 0."""
    poses = []
    for b in chain:
        joint = int(model.body_jntadr[b])
        axis, drawn_at = model.jnt_axis[joint], float(model.qpos0[model.jnt_qposadr[joint]])
        if model.jnt_type[joint] == _HINGE:
            to_zero = _Pose(rotation_about(axis, -drawn_at), np.zeros(3))
        else:
            to_zero = _Pose(np.eye(3), -drawn_at * axis)
        drawn = tree.pose[int(model.body_parentid[b])] @ _placed(model.body_pos[b], model.body_quat[b])
        poses.append(drawn @ _Pose(np.eye(3), _anchor(model, b)) @ to_zero)
    return np.array([p.rotation for p in poses]), np.array([p.translation for p in poses])


def _link_inertias(model: Any, n: int, tree: _Tree) -> tuple[Array, Array, Array]:
    """Mass (n,), centre of mass (n, 3) and inertia (n, 3, 3) of each link with all bodies that it carries."""
    mass, com, inertia = np.zeros(n), np.zeros((n, 3)), np.zeros((n, 3, 3))
    for b, i in enumerate(tree.owner):
        if i >= 0:
            at = tree.pose[b] @ _placed(model.body_ipos[b], model.body_iquat[b])
            about_com = at.rotation @ np.diag(model.body_inertia[b]) @ at.rotation.T
            mass[i], com[i], inertia[i] = joined_inertia(
                mass[i], com[i], inertia[i], float(model.body_mass[b]), at.translation, about_com
            )
    return mass, com, 0.5 * (inertia + np.swapaxes(inertia, 1, 2))


def _find_tip(
    model: Any, path: Path, name: str, tip: str | None, bodies: list[str], sites: list[str]
) -> tuple[str, int]:
    """Name of the tip and the body that carries it."""
    for wanted in _TIPS if tip is None else (tip,):
        if wanted in sites:
            return wanted, int(model.site_bodyid[sites.index(wanted)])
        if wanted in bodies:
            return wanted, bodies.index(wanted)
    if tip is not None:
        raise UnknownFrameError(name, tip, [frame for frame in (*sites, *bodies[1:]) if frame])
    last = _last_link(model)
    if last == 0:
        raise RobotFileError(path, "is not an arm: no chain of hinge and slide joints starts at its base")
    return bodies[last], last


def _last_link(model: Any) -> int:
    """The last body of the longest chain, or the one where its fingers branch off (fewer joints beyond than before)."""
    joints, depth = np.zeros(model.nbody, dtype=int), np.zeros(model.nbody, dtype=int)
    for b in range(1, model.nbody):
        parent, first = int(model.body_parentid[b]), int(model.body_jntadr[b])
        serial = np.isin(model.jnt_type[first : first + model.body_jntnum[b]], (_SLIDE, _HINGE)).all()
        joints[b] = joints[parent] + model.body_jntnum[b] if serial else -1_000_000
        depth[b] = depth[parent] + 1
    last = max(range(model.nbody), key=lambda b: (joints[b], depth[b]))
    if joints[last] <= 0:
        return 0
    moving = np.zeros(model.nbody, dtype=int)  # children of each body that lead to more joints
    for b in range(model.nbody - 1, 0, -1):
        moving[model.body_parentid[b]] += bool(moving[b] or model.body_jntnum[b])
    path = _ancestry(model, last)
    for b in path:
        if moving[b] > 1 and joints[last] - joints[b] < joints[b]:
            return b
    return last


def _ancestry(model: Any, body: int) -> list[int]:
    """The bodies from below the world down to `body`."""
    path = []
    while body > 0:
        path.append(body)
        body = int(model.body_parentid[body])
    return path[::-1]


def _chain(model: Any, path: Path, tip_body: int, bodies: list[str], overrides: Overrides) -> list[int]:
    """The moving bodies from the base to the tip, each checked to have one hinge or slide joint."""
    chain = [b for b in _ancestry(model, tip_body) if model.body_jntnum[b] > 0]
    if not chain:
        raise RobotFileError(path, f"is not an arm: no joint moves {bodies[tip_body]!r}")
    for b in chain:
        j = int(model.body_jntadr[b])
        label = _label(model.joint(j).name, j, kind="joint")
        if model.jnt_type[j] in (_FREE, _BALL):
            kind = "free" if model.jnt_type[j] == _FREE else "ball"
            raise RobotFileError(
                path, f"joint {label!r} on the way to the tip is a {kind} joint; an arm has hinges and slides only"
            )
        if model.body_jntnum[b] > 1:
            raise RobotFileError(
                path,
                f"body {bodies[b]!r} has {model.body_jntnum[b]} joints: give each its own body with mass and inertia",
            )
        if label in overrides.mimics:
            raise RobotFileError(
                path, f"joint {label!r} on the way to the tip mimics {overrides.mimics[label]!r}: not a serial arm"
            )
    return chain


def _frames(model: Any, bodies: list[str], sites: list[str], tree: _Tree) -> dict[str, Frame]:
    """Named bodies and sites that are fixed to a link or the base; a site wins over a body of its name."""
    frames = {}
    for b, label in enumerate(bodies):
        if tree.rigid[b] and (b > 0 or tree.base == 0):
            frames[label] = Frame(tree.owner[b], tree.pose[b].rotation, tree.pose[b].translation)
    for s, label in enumerate(sites):
        b = int(model.site_bodyid[s])
        if label and tree.rigid[b]:
            at = tree.pose[b] @ _placed(model.site_pos[s], model.site_quat[s])
            frames[label] = Frame(tree.owner[b], at.rotation, at.translation)
    return frames


def _capsules(model: Any, tree: _Tree) -> tuple[Capsule, ...]:
    """Spheres, capsules, cylinders and boxes that can collide, the latter two as capsules of the same length."""
    capsules = []
    for g in range(model.ngeom):
        b, kind, size = int(model.geom_bodyid[g]), int(model.geom_type[g]), model.geom_size[g]
        collides = model.geom_contype[g] or model.geom_conaffinity[g]
        on_arm = tree.rigid[b] and (tree.owner[b] >= 0 or b == tree.base > 0)
        if not (collides and on_arm) or kind not in (_SPHERE, _CAPSULE, _CYLINDER, _BOX):
            continue
        along = int(np.argmax(size)) if kind == _BOX else 2
        radius = float(np.delete(size, along).mean() if kind == _BOX else size[0])
        if kind == _CAPSULE:
            half = float(size[1])
        else:
            half = max(float(size[along] if kind == _BOX else size[1]) - radius, 0.0)  # a sphere's size[1] is 0
        at = tree.pose[b] @ _placed(model.geom_pos[g], model.geom_quat[g])
        reach = half * at.rotation[:, along]
        capsules.append(Capsule(tree.owner[b], at.translation - reach, at.translation + reach, radius))
    return tuple(capsules)


def _torque_limit(model: Any, joint: int) -> float:
    """The tightest of the joint's own limit and those of its actuators."""
    limits = [np.inf]
    if model.jnt_actfrclimited[joint]:
        limits.append(np.abs(model.jnt_actfrcrange[joint]).max())
    for a in np.flatnonzero((model.actuator_trntype == _TRANSMISSION_JOINT) & (model.actuator_trnid[:, 0] == joint)):
        gear = abs(model.actuator_gear[a, 0])
        if model.actuator_forcelimited[a]:
            limits.append(gear * np.abs(model.actuator_forcerange[a]).max())
        if model.actuator_ctrllimited[a] and not (model.actuator_biastype[a] or model.actuator_dyntype[a]):
            limits.append(gear * np.abs(model.actuator_gainprm[a, 0] * model.actuator_ctrlrange[a]).max())
    return float(min(limits))


def _home(model: Any) -> Array:
    """Positions of the keyframe `home`, else of the file as drawn."""
    names = [model.key(k).name for k in range(model.nkey)]
    return np.asarray(model.key_qpos[names.index("home")] if "home" in names else model.qpos0)


def _placed(position: Array, quaternion: Array) -> _Pose:
    return _Pose(rotation_from_quaternion(quaternion), np.array(position))


def _label(name: str, index: int, overrides: Overrides | None = None, *, kind: str = "body") -> str:
    if overrides is not None and index == 0 and overrides.root:
        return overrides.root
    return name or f"{kind}{index}"
