"""The MuJoCo model of a work cell."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from tactful.errors import TactfulError
from tactful.robots import Robot
from tactful.simulation._config import CellConfig
from tactful.simulation._fixtures import Fixture

_LEAST_IMPEDANCE = 0.0001  # MuJoCo's bound: a contact begins with almost none
_FULL_IMPEDANCE = 0.95
_SPRING_DAMPING_S = 0.001
"""Damping of an elastic joint over its stiffness, where the arm's is not known [s]; an assumption."""


def build_model(robot: Robot, fixtures: Sequence[Fixture], config: CellConfig) -> Any:
    """Return the compiled model: the arm with a motor a joint, its gravity compensated, and the fixtures.

    Raises:
        TactfulError: if MuJoCo is not installed, or it cannot build the cell.
    """
    try:
        import mujoco
    except ImportError:
        raise TactfulError('the work cell needs MuJoCo: pip install "tactful[mujoco]"') from None
    spec = mujoco.MjSpec.from_string(robot.to_mjcf())
    spec.option.timestep = config.period_s / config.substeps
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_EULER
    spec.option.tolerance = 1e-14  # of the contact forces: the default leaves errors of 1e-4 Nm
    spec.option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
    for fixture in fixtures:
        _add(fixture, spec, config)
    for name, inertia in zip(robot.joint_names, robot.motor_inertia, strict=True):
        joint = spec.joint(name)
        joint.actgravcomp = True
        joint.armature = inertia if robot.torque_sensor == "motor" else config.rotor_inertia_kg_m2
        spec.add_actuator(name=name, target=name, trntype=mujoco.mjtTrn.mjTRN_JOINT)
    for name in robot.link_names:
        spec.body(name).gravcomp = 1.0
    if config.elastic:
        _soften(spec, robot)
    try:
        return spec.compile()
    except ValueError as error:
        raise TactfulError(f"{robot.name}: the work cell cannot be built: {' '.join(str(error).split())}") from None


def _soften(spec: Any, robot: Robot) -> None:
    """Put the elasticity of the gear behind every joint: a second hinge on its axis, with a spring and a damper."""
    if not np.isfinite(robot.stiffness).all():
        raise TactfulError(f"{robot.name}: the stiffness of its joints is not known: leave `elastic` off")
    damping = np.where(np.isfinite(robot.damping), robot.damping, _SPRING_DAMPING_S * robot.stiffness)
    for i in range(robot.n):
        joint = spec.joint(robot.joint_names[i])
        spec.body(robot.link_names[i]).add_joint(
            name=f"{robot.joint_names[i]} spring",
            type=joint.type,
            axis=joint.axis,
            pos=joint.pos,
            stiffness=robot.stiffness[i],
            damping=damping[i],
        )


def _add(fixture: Fixture, spec: Any, config: CellConfig) -> None:
    """Add a fixture, whose contacts follow the cell's settings, whatever the arm's geoms say."""
    try:
        fixture.attach(spec.worldbody)
    except ValueError as error:
        raise TactfulError(f"fixture {fixture.name!r} cannot be added: {' '.join(str(error).split())}") from None
    body = spec.body(fixture.name)
    if body is None:
        raise TactfulError(f"fixture {fixture.name!r} adds no body of that name: call world.add_body(name=self.name)")
    for geom in body.geoms:
        geom.contype, geom.conaffinity, geom.priority = 1, 1, 1
        geom.friction = [config.friction, 0.005, 0.0001]
        geom.solref = [config.contact_time_s, 1.0]
        geom.solimp = [_LEAST_IMPEDANCE, _FULL_IMPEDANCE, config.contact_depth_m, 0.5, 2.0]
