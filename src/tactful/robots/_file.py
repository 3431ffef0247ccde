"""Read an arm from an MJCF or URDF file, through MuJoCo's compiler."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as ET

import numpy as np

from tactful.robots._chain import Overrides, robot_from_model
from tactful.robots._errors import RobotFileError
from tactful.robots._robot import Robot


def load_file(path: Path, tip: str | None) -> Robot:
    """The serial chain of `path` that ends at `tip`; the root element tells MJCF from URDF.

    Raises:
        RobotFileError: The file is missing, torn, or not a serial arm; or MuJoCo is not installed.
        UnknownFrameError: The file has no site or link `tip`.
    """
    try:
        root = ET.parse(path).getroot()
    except OSError as error:
        raise RobotFileError(path, f"cannot be read: {error.strerror}") from None
    except (ET.ParseError, UnicodeDecodeError) as error:
        raise RobotFileError(path, f"is not well-formed XML: {error}") from None
    if root.tag not in ("mujoco", "robot"):
        raise RobotFileError(path, f"is neither MJCF (<mujoco>) nor URDF (<robot>): its root is <{root.tag}>")
    try:
        import mujoco
    except ImportError:
        raise RobotFileError(path, 'needs MuJoCo to be read: pip install "tactful[mujoco]"') from None
    overrides = Overrides()
    try:
        with warnings.catch_warnings(action="ignore"):  # of the simulation that the compiler tries
            if root.tag == "robot":
                overrides = _urdf_overrides(path, root)
                model = mujoco.MjModel.from_xml_string(_bare_urdf(root))
            else:
                model = _compile_mjcf(mujoco, path)
    except ValueError as error:
        raise RobotFileError(path, f"cannot be compiled: {error}") from None
    name = root.get("name" if root.tag == "robot" else "model") or path.stem
    return robot_from_model(model, path, name, tip, overrides)


def _compile_mjcf(mujoco: Any, path: Path) -> Any:
    """Compile without the meshes that give no body its inertia, so that their files need not be there."""
    spec = mujoco.MjSpec.from_file(str(path))
    if spec.compiler.inertiafromgeom != mujoco.mjtInertiaFromGeom.mjINERTIAFROMGEOM_TRUE:
        needed = set()
        for geom in spec.geoms:
            massless = geom.mass == 0 or (np.isnan(geom.mass) and geom.density == 0)
            unneeded = massless or geom.parent.explicitinertial or not _moves(geom.parent)
            if geom.type == mujoco.mjtGeom.mjGEOM_MESH and unneeded:
                spec.delete(geom)
            elif geom.meshname:
                needed.add(geom.meshname)
        for mesh in spec.meshes:
            if mesh.name not in needed:
                spec.delete(mesh)
    for geom in spec.geoms:
        geom.material = ""
    for element in (*spec.materials, *spec.textures, *spec.skins, *spec.sensors, *spec.pairs, *spec.flexes):
        spec.delete(element)
    return spec.compile()


def _moves(body: Any) -> bool:
    return body is not None and (bool(body.joints) or _moves(body.parent))


def _bare_urdf(root: ET.Element) -> str:
    """The URDF without shapes, with the options that keep MuJoCo from merging its fixed links."""
    for link in root.iter("link"):
        for shape in (*link.findall("visual"), *link.findall("collision")):
            link.remove(shape)
    for extension in (*root.findall("mujoco"), *root.findall("gazebo"), *root.findall("transmission")):
        root.remove(extension)
    ET.SubElement(ET.SubElement(root, "mujoco"), "compiler", fusestatic="false", strippath="true")
    return ET.tostring(root, encoding="unicode")


def _urdf_overrides(path: Path, root: ET.Element) -> Overrides:
    """What URDF says and MJCF cannot, or MuJoCo does not read."""
    if any("xacro" in element.tag for element in root.iter()):
        raise RobotFileError(path, "holds xacro macros: expand them first (xacro FILE > robot.urdf)")
    children = {child.get("link") for child in root.iterfind("joint/child")}
    velocity, torque, mimics = {}, {}, {}
    for joint in root.findall("joint"):
        name = joint.get("name", "")
        if (limit := joint.find("limit")) is not None:
            velocity[name] = _positive(limit.get("velocity"))
            torque[name] = _positive(limit.get("effort"))
        if (mimic := joint.find("mimic")) is not None:
            mimics[name] = mimic.get("joint", "")
    roots = [link.get("name", "") for link in root.findall("link") if link.get("name") not in children]
    return Overrides(root=roots[0] if roots else "", velocity_limit=velocity, torque_limit=torque, mimics=mimics)


def _positive(text: str | None) -> float:
    """A limit as URDF writes it, where a missing or zero one means that it is unknown."""
    value = float(text or "0")
    return value if value > 0 else float("inf")
