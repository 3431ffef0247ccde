"""The arm with the peg that it is to insert."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from tactful.monitor import RobotConfig
from tactful.robots import Capsule, Frame, Robot

PEG_RADIUS_M = 0.015
PEG_LENGTH_M = 0.12
"""From the flange to the peg's round end [m]."""
PEG = RobotConfig(model="panda", payload_kg=0.4, payload_com_m=(0.0, 0.0, 0.06))
"""The arm as its monitor knows it: a Panda with the mass of the peg at its flange."""


def peg_arm() -> Robot:
    """Return the Panda with the peg on its flange, as it should be: its tip is the frame `peg`, at the peg's end."""
    robot = PEG.load()
    assert robot is not None
    flange = robot.frames["flange"]
    along = np.array([0.0, 0.0, 1.0])
    start, end = (flange.rotation @ (x * along) + flange.translation for x in (0.0, PEG_LENGTH_M - PEG_RADIUS_M))
    peg = Capsule(link=flange.link, p0_m=start, p1_m=end, radius_m=PEG_RADIUS_M)
    tip = Frame(flange.link, flange.rotation, flange.rotation @ (PEG_LENGTH_M * along) + flange.translation)
    return replace(robot, frames={**robot.frames, "peg": tip}, capsules=(*robot.capsules, peg), tip="peg")


def mistaken(robot: Robot, rng: np.random.Generator, *, scale: float = 1.0) -> Robot:
    """Return an arm as it may be in truth where `robot` is its model.

    Mass within 2 %, centre of mass within 2 mm, inertia within 5 %, each as a standard deviation, and a payload at the
    tip that is off by 30 g. The figures are assumptions; a calibrated model is about as good.

    Args:
        robot: the model.
        rng: the source of the errors.
        scale: by which all errors are multiplied.
    """
    n = robot.n
    mass = robot.mass * np.clip(1 + 0.02 * scale * rng.standard_normal(n), 0.5, 1.5)
    com = robot.com + 0.002 * scale * rng.standard_normal((n, 3))
    inertia = robot.inertia * np.clip(1 + 0.05 * scale * rng.standard_normal(n), 0.5, 1.5)[:, None, None]
    last = robot.frames[robot.tip].link
    mass[last] = max(mass[last] + 0.03 * scale * rng.standard_normal(), 0.5 * robot.mass[last])
    return replace(robot, mass=mass, com=com, inertia=inertia)
