"""The torque on the links of an arm with elastic joints, from signals of both sides."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tactful.config import ConfigError
from tactful.errors import TactfulError
from tactful.robots import Robot

Array = NDArray[np.float64]


def elastic_torque(robot: Robot, q: ArrayLike, dq: ArrayLike, theta: ArrayLike, dtheta: ArrayLike) -> Array:
    r"""Return the torque that elastic joints exert on the links, from positions and velocities of motors and links.

        tau_J + D K^-1 dtau_J/dt = K (theta - q) + D (dtheta - dq)

    It is all that the momentum equation of the links needs: pass it to `MomentumObserver` as `tau`, without
    `joint_flexibility`, which would add the second term from the difference of a measured tau_J.

    Source: B. Proper et al. 2023, https://hal.science/hal-03974694v3, (1) and (6).

    Args:
        robot: the arm, with `stiffness` K and `damping` D.
        q: positions of the links (..., n) [rad].
        dq: their velocities (..., n) [rad/s].
        theta: positions of the motors behind the gear (..., n) [rad].
        dtheta: their velocities (..., n) [rad/s].

    Returns:
        Torque on the links (..., n) [Nm].

    Raises:
        ConfigError: if the stiffness or the damping of a joint is not known.
        TactfulError: if the shapes do not fit.
    """
    for figure, known in (("stiffness", robot.stiffness > 0), ("damping", np.isfinite(robot.damping))):
        if not known.all():
            problem = f"is not known for joint {robot.joint_names[int(np.argmin(known))]} of {robot.name}; give it"
            raise ConfigError("robot", figure, problem)
    signals = [np.asarray(x, dtype=np.float64) for x in (q, dq, theta, dtheta)]
    shape = signals[0].shape
    for name, x in zip(("q", "dq", "theta", "dtheta"), signals, strict=True):
        if x.shape != shape or shape[-1:] != (robot.n,):
            raise TactfulError(f"{name} has shape {x.shape}: all four need the same shape (..., {robot.n})")
    links, links_speed, motors, motors_speed = signals
    return np.asarray(robot.stiffness * (motors - links) + robot.damping * (motors_speed - links_speed))
