"""The arms that come with the package: one TOML file each in `data/`."""

from __future__ import annotations

import tomllib
from functools import cache
from importlib.resources import files
from typing import Any

import numpy as np

from tactful.robots._geometry import Capsule, Frame, rotation_from_rpy
from tactful.robots._robot import Robot


@cache
def builtin_names() -> tuple[str, ...]:
    """Names of the data files, sorted."""
    return tuple(sorted(f.name.removesuffix(".toml") for f in files("tactful.robots").joinpath("data").iterdir()))


def load_builtin(name: str) -> Robot:
    """Read one data file; what it leaves out is unknown: no limit, no friction, no elasticity."""
    data = tomllib.loads(files("tactful.robots").joinpath("data", f"{name}.toml").read_text("utf-8"))
    joints: list[dict[str, Any]] = data["joints"]
    links = {"base": -1} | {joint["link"]: i for i, joint in enumerate(joints)}

    def column(key: str, default: float) -> list[float]:
        return [joint.get(key, default) for joint in joints]

    return Robot(
        name=name,
        title=data["title"],
        source=data["source"],
        joint_names=tuple(joint["name"] for joint in joints),
        link_names=tuple(joint["link"] for joint in joints),
        prismatic=np.zeros(len(joints), dtype=np.bool_),
        rotation=np.array([_rotation(joint) for joint in joints]),
        translation=np.array([joint["xyz_m"] for joint in joints]),
        axis=np.array([joint.get("axis", (0, 0, 1)) for joint in joints]),
        mass=np.array([joint["mass_kg"] for joint in joints]),
        com=np.array([joint["com_m"] for joint in joints]),
        inertia=np.array([_symmetric(joint["inertia_kg_m2"]) for joint in joints]),
        lower=np.array(column("lower_rad", -np.inf)),
        upper=np.array(column("upper_rad", np.inf)),
        velocity_limit=np.array(column("velocity_limit_rad_s", np.inf)),
        torque_limit=np.array(column("torque_limit_nm", np.inf)),
        motor_inertia=np.array(column("motor_inertia_kg_m2", 0.0)),
        stiffness=np.array(column("stiffness_nm_rad", np.nan)),
        damping=np.array(column("damping_nms_rad", np.nan)),
        coulomb_friction=np.array(column("coulomb_friction_nm", 0.0)),
        viscous_friction=np.array(column("viscous_friction_nms_rad", 0.0)),
        torque_sensor=data["torque_sensor"],
        home=np.array(data["home_rad"]),
        frames={
            key: Frame(links[frame["link"]], _rotation(frame), np.array(frame["xyz_m"], dtype=np.float64))
            for key, frame in data["frames"].items()
        },
        tip=data["tip"],
        capsules=tuple(
            Capsule(links[c["link"]], np.array(c["p0_m"]), np.array(c["p1_m"]), c["radius_m"])
            for c in data.get("capsules", ())
        ),
        reach_m=data["reach_m"],
    )


def _rotation(item: dict[str, Any]) -> np.ndarray[Any, np.dtype[np.float64]]:
    return rotation_from_rpy(np.radians(item.get("rpy_deg", (0.0, 0.0, 0.0))))


def _symmetric(entries: list[float]) -> list[list[float]]:
    xx, xy, xz, yy, yz, zz = entries
    return [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]
