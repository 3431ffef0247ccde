"""The arm with its flat tool."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from tactful.impacts import ContactPoint
from tactful.robots import Capsule, Frame, Robot
from tactful.simulation.impact_bench._config import FlatToolConfig

TIP = "face"
"""Name of the frame in the middle of the tool's face, with its z out of the tool."""


def flat_tool(robot: Robot, tool: FlatToolConfig | None = None) -> Robot:
    """Return the arm with a flat tool at its tip, its mass that of a plate: the new tip is the frame `face`."""
    tool = tool or FlatToolConfig()
    flange = robot.frames[robot.tip]
    a, b = 2 * tool.half_length_m, 2 * tool.half_width_m
    inertia = tool.mass_kg / 12 * np.diag([b**2, a**2, a**2 + b**2])
    loaded = robot.with_payload(tool.mass_kg, (0.0, 0.0, 0.8 * tool.length_m), inertia)
    face = Frame(flange.link, flange.rotation, flange.translation + flange.rotation @ [0.0, 0.0, tool.length_m])
    feet = []
    for corner in corners(tool):
        centre = face.translation + flange.rotation @ (corner - [0.0, 0.0, tool.foot_radius_m])
        feet.append(Capsule(flange.link, centre, centre, tool.foot_radius_m))
    frames = {**loaded.frames, TIP: face}
    return replace(loaded, frames=frames, tip=TIP, capsules=(*robot.capsules, *feet))


def corners(tool: FlatToolConfig) -> np.ndarray[tuple[int, int], np.dtype[np.float64]]:
    """Return where the feet touch, in the frame of the face (4, 3) [m]."""
    x, y = tool.half_length_m, tool.half_width_m
    return np.array([[x, y, 0.0], [x, -y, 0.0], [-x, y, 0.0], [-x, -y, 0.0]])


def contact_points(robot: Robot, tool: FlatToolConfig, normal: tuple[float, float, float]) -> tuple[ContactPoint, ...]:
    """Return the points of the tool that are to touch a surface with this normal."""
    face = robot.frames[TIP]
    return tuple(
        ContactPoint(face.link, face.translation + face.rotation @ corner, np.array(normal)) for corner in corners(tool)
    )
