"""From a task to the references of the controller and the plan of the monitor."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from tactful.control import ReferenceSpreading
from tactful.dynamics import Dynamics
from tactful.impacts import ContactPoint, ImpactPlan, impact
from tactful.simulation.planar._arm import inverse_kinematics, jacobian, planar_robot, point_jacobians
from tactful.simulation.planar._config import PlanarConfig, TaskConfig

Array = NDArray[np.float64]

FACE_DOWN = -math.pi / 2
"""Angle of the last link where its face lies on the planned surface [rad]."""
_BEFORE_S, _GRID_S = 0.25, 0.001


def plan_impact(
    alpha_deg: float, x_imp_m: float, config: PlanarConfig | None = None
) -> tuple[ImpactPlan, ReferenceSpreading]:
    r"""Plan an impact on the horizontal surface: rigid impact map, quintic references, joint reference after it.

    The tip comes with v (cos(alpha), -sin(alpha)) and its face parallel to the surface; the references lead there from
    rest over half the way that the speed would take, and on so after the impact. An object that gives way is one more
    body in the impact map, free to move along the normal. The joint velocity of the post-impact
    reference is J^-1 of that of the tip.

    Source: B. Proper et al. 2023, https://hal.science/hal-03974694v3, Sec. III-A and IV-A.

    Args:
        alpha_deg: angle of approach to the surface [deg].
        x_imp_m: where on the surface the impact is wanted [m].
        config: the arm and its task.

    Returns:
        The plan for the monitor, and the references for the controller.

    Raises:
        TactfulError: if the motion is out of reach.
    """
    config = config or PlanarConfig()
    arm, task = config.arm, config.task
    angle = math.radians(alpha_deg)
    pose = np.array([x_imp_m, task.height_m, FACE_DOWN])
    before = task.speed_m_s * np.array([math.cos(angle), -math.sin(angle), 0.0])
    robot = planar_robot(arm)
    q_d = inverse_kinematics(arm, pose, task.elbow)
    J = jacobian(arm, q_d)
    J_N, J_T = point_jacobians(arm, q_d)
    M_r = Dynamics(robot, motor_inertia=True).mass_matrix(q_d)
    dq_minus = np.asarray(np.linalg.solve(J, before), dtype=np.float64)
    after: Array = J @ _after(M_r, dq_minus, J_N, J_T, task)
    end = pose + 0.5 * (task.end_s - task.impact_s) * after
    if task.object_mass_kg is None:
        end[1] = task.height_m
    start = pose - 0.5 * task.impact_s * before
    reference = ReferenceSpreading.between(
        (0.0, task.impact_s, task.end_s), np.array([start, pose, end]), np.array([before, after])
    )
    span = max(config.duration_s, task.end_s) - task.impact_s
    steps: Array = np.arange(-round(_BEFORE_S / _GRID_S), round(span / _GRID_S) + 1, dtype=np.float64)
    t = task.impact_s + _GRID_S * steps  # (k,)
    path = np.array([reference.at(float(s), post=True)[:2] for s in t])  # (k, 2, 3)
    q = inverse_kinematics(arm, path[:, 0], task.elbow)
    dq = np.asarray(np.linalg.solve(jacobian(arm, q), path[:, 1, :, None])[..., 0], dtype=np.float64)
    contacts = [
        ContactPoint(2, np.array([arm.length_m[2], offset, 0.0]), np.array([0.0, 1.0, 0.0])) for offset in arm.offsets_m
    ]
    turn = np.array([[0.0, 0.0, 0.0], [1.0, 1.0, 1.0]])  # about x, which it cannot, and about z
    return ImpactPlan(task.impact_s, q_d, t, dq, q, contacts=tuple(contacts), turn=turn), reference


def _after(M_r: Array, dq: Array, J_N: Array, J_T: Array, task: TaskConfig) -> Array:
    """Return the joint velocity (3,) after the impact that is planned."""
    if task.object_mass_kg is not None:  # the object's velocity along the normal is a fourth coordinate
        M_r = np.block([[M_r, np.zeros((3, 1))], [np.zeros((1, 3)), np.array([[task.object_mass_kg]])]])
        dq = np.append(dq, 0.0)
        J_N, J_T = (np.column_stack([J, np.full(len(J), own)]) for J, own in ((J_N, -1.0), (J_T, 0.0)))
    return impact(M_r, dq, J_N, J_T[:, None], restitution=task.restitution, friction=task.friction).dq_plus[:3]
