"""Write a robot as MJCF, the format of MuJoCo, without needing MuJoCo."""

from __future__ import annotations

from xml.etree import ElementTree as ET

import numpy as np
from numpy.typing import ArrayLike

from tactful.robots._geometry import quaternion_from_rotation
from tactful.robots._robot import Robot

_SITE_SIZE_M = "0.005"


def to_mjcf(robot: Robot) -> str:
    """The MJCF document; numbers are written so that reading them gives the same floats."""
    root = ET.Element("mujoco", model=robot.name)
    ET.SubElement(root, "compiler", angle="radian", autolimits="false", inertiafromgeom="false")
    ET.SubElement(root, "option", gravity=_numbers(robot.gravity))
    body = ET.SubElement(ET.SubElement(root, "worldbody"), "body")
    if "base" not in robot.link_names:
        body.set("name", "base")
    _attach(body, robot, -1)
    for i in range(robot.n):
        body = ET.SubElement(
            body, "body", name=robot.link_names[i], pos=_numbers(robot.translation[i]), quat=_quat(robot.rotation[i])
        )
        xx, yy, zz = np.diag(robot.inertia[i])
        xy, xz, yz = robot.inertia[i][np.triu_indices(3, 1)]
        ET.SubElement(
            body,
            "inertial",
            mass=_numbers(robot.mass[i]),
            pos=_numbers(robot.com[i]),
            fullinertia=_numbers([xx, yy, zz, xy, xz, yz]),
        )
        ET.SubElement(body, "joint", _joint(robot, i))
        _attach(body, robot, i)
    ET.indent(root)
    return ET.tostring(root, encoding="unicode") + "\n"


def _joint(robot: Robot, i: int) -> dict[str, str]:
    attributes = {
        "name": robot.joint_names[i],
        "type": "slide" if robot.prismatic[i] else "hinge",
        "axis": _numbers(robot.axis[i]),
        "armature": _numbers(robot.motor_inertia[i]),
        "damping": _numbers(robot.viscous_friction[i]),
        "frictionloss": _numbers(robot.coulomb_friction[i]),
    }
    if np.isfinite([robot.lower[i], robot.upper[i]]).all():
        attributes |= {"limited": "true", "range": _numbers([robot.lower[i], robot.upper[i]])}
    if np.isfinite(robot.torque_limit[i]) and robot.torque_limit[i] > 0:
        limits = _numbers([-robot.torque_limit[i], robot.torque_limit[i]])
        attributes |= {"actuatorfrclimited": "true", "actuatorfrcrange": limits}
    return attributes


def _attach(body: ET.Element, robot: Robot, link: int) -> None:
    """Write the sites and capsules that are fixed to a link."""
    for name, frame in robot.frames.items():
        if frame.link == link:
            pose = {"pos": _numbers(frame.translation), "quat": _quat(frame.rotation)}
            ET.SubElement(body, "site", {"name": name, **pose, "size": _SITE_SIZE_M, "group": "4"})
    for capsule in robot.capsules:
        if capsule.link == link:
            shape = (
                {"type": "sphere", "pos": _numbers(capsule.p0_m)}
                if np.array_equal(capsule.p0_m, capsule.p1_m)
                else {"type": "capsule", "fromto": _numbers([*capsule.p0_m, *capsule.p1_m])}
            )
            look = {"contype": "0", "group": "3", "mass": "0"}  # meets other geoms (conaffinity 1) but not itself
            ET.SubElement(body, "geom", {**shape, "size": _numbers(capsule.radius_m), **look})


def _numbers(values: ArrayLike) -> str:
    return " ".join(repr(float(v)) for v in np.ravel(values))


def _quat(rotation: ArrayLike) -> str:
    return _numbers(quaternion_from_rotation(np.asarray(rotation)))
