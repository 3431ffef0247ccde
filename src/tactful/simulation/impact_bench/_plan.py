"""From a task to the references of the controller and the plan of the monitor, for any serial arm."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from tactful.control import Pose, ReferenceSpreading, orientation_error, reach
from tactful.control._impact_aware_arm import consistent_inverse, turned
from tactful.dynamics import Dynamics
from tactful.impacts import ContactPoint, ImpactPlan, impact
from tactful.robots import Robot
from tactful.simulation.impact_bench._arm import contact_points, flat_tool
from tactful.simulation.impact_bench._config import BenchConfig

Array = NDArray[np.float64]

NORMAL = (0.0, 0.0, 1.0)
FACE_DOWN = np.array([[1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, -1.0]])
"""Orientation of the face where it lies on the planned platform."""
_BEFORE_S, _STEP_S = 0.25, 0.002
_PULL = 50.0
"""Rate at which the joint reference comes back to the tip's [1/s]."""


@dataclass(frozen=True, eq=False)
class BenchPlan:
    """A planned impact of an arm with a flat tool, n joints.

    Attributes:
        robot: the arm as its planner knows it, with its tool and with the motors as the torque loop leaves them.
        impact: what the monitor needs; its reference comes from the impact map.
        reference: what the controller follows: position of the face, and a rotation vector from its orientation at
            the impact, in base axes.
        q_start: where the motion begins (n,) [rad].
        dq_minus, dq_plus: joint velocity before and after the rigid impact (n,) [rad/s].
    """

    robot: Robot
    impact: ImpactPlan
    reference: ReferenceSpreading
    q_start: Array
    dq_minus: Array
    dq_plus: Array


def bench_arm(config: BenchConfig) -> Robot:
    """Return the arm as its planner knows it."""
    arm = flat_tool(Robot.load(config.robot), config.tool)
    return replace(arm, motor_inertia=np.full(arm.n, config.cell.rotor_inertia_kg_m2))


def plan_strike(alpha_deg: float, config: BenchConfig | None = None) -> BenchPlan:
    r"""Plan an impact of the flat tool on the level platform: rigid impact map, quintic references, joint reference.

    The face comes with v (cos(alpha), 0, -sin(alpha)), parallel to the platform, from rest over half the way that the
    speed would take. Of the joint motions that do this the one of least kinetic energy is taken, J^# \dot x with
    J^# = M_r^-1 J^T (J M_r^-1 J^T)^-1: an impact on the tip does not leave these, so that the post-impact reference of
    the joints is J^# \dot x, too. Four points in one plane constrain each other, which `impact` allows.

    Source: B. Proper et al. 2023, https://hal.science/hal-03974694v3, Sec. III-A and IV.

    Args:
        alpha_deg: angle of approach to the platform [deg].
        config: the bench.

    Raises:
        TactfulError: if the motion is out of reach.
    """
    config = config or BenchConfig()
    task, robot = config.task, bench_arm(config)
    dynamics = Dynamics(robot, motor_inertia=True)
    place = np.array([task.x_m, 0.0, task.height_m])
    q_d = _reach(robot, place)
    points = contact_points(robot, config.tool, NORMAL)
    angle = math.radians(alpha_deg)
    before = np.zeros(6)
    before[:3] = task.speed_m_s * np.array([math.cos(angle), 0.0, -math.sin(angle)])
    M_r, J = dynamics.mass_matrix(q_d), dynamics.jacobian(q_d)
    dq_minus = consistent_inverse(M_r, J) @ before
    jacobians = np.array([_at(dynamics, q_d, point) for point in points])  # (4, 3, n)
    result = impact(
        M_r, dq_minus, jacobians[:, 2], jacobians[:, :2], restitution=task.restitution, friction=task.friction
    )
    after = J @ result.dq_plus
    pose = np.concatenate([place, np.zeros(3)])
    start, end = pose - 0.5 * task.impact_s * before, pose + 0.5 * (task.end_s - task.impact_s) * after
    end[2] = task.height_m
    reference = ReferenceSpreading.between(
        (0.0, task.impact_s, task.end_s), np.array([start, pose, end]), np.array([before, after])
    )
    span = max(config.duration_s, task.end_s) - task.impact_s
    t_early, q_early, dq_early = _joints(dynamics, reference, q_d, -_BEFORE_S, post=True)
    t_late, q_late, dq_late = _joints(dynamics, reference, q_d, span, post=True)
    plan = ImpactPlan(
        task.impact_s,
        q_d,
        np.concatenate([t_early[:0:-1], t_late]),
        np.concatenate([dq_early[:0:-1], dq_late]),
        np.concatenate([q_early[:0:-1], q_late]),
        contacts=points,
    ).with_turn(robot)
    q_start = _joints(dynamics, reference, q_d, -task.impact_s, post=False)[1][-1]
    return BenchPlan(robot, plan, reference, q_start, dq_minus, np.array(result.dq_plus))


def _reach(robot: Robot, place: Array) -> Array:
    """Return the joint positions (n,) near `home` that put the face there, exactly."""
    q = reach(robot, Pose(FACE_DOWN, place), np.array(robot.home))
    dynamics = Dynamics(robot)
    for _ in range(5):
        q = q + np.linalg.pinv(dynamics.jacobian(q)) @ _pose_error(dynamics, q, place, FACE_DOWN)
    return q


def _pose_error(dynamics: Dynamics, q: Array, place: Array, rotation: Array) -> Array:
    """Return by how much the tip has to move and to turn (6,)."""
    R, x = dynamics.pose(q)
    return np.concatenate([place - x, 2.0 * orientation_error(R, rotation)])


def _at(dynamics: Dynamics, q: Array, point: ContactPoint) -> Array:
    """Return the Jacobian (3, n) of a contact point: in the surface twice, and along its normal."""
    tip = dynamics.robot.frames[dynamics.robot.tip]
    R, x = dynamics.pose(q)
    where = x + R @ tip.rotation.T @ (point.point_m - tip.translation)
    return dynamics.jacobian_at(q, point.link, where)[:3]


def _joints(
    dynamics: Dynamics, reference: ReferenceSpreading, q_d: Array, span_s: float, *, post: bool
) -> tuple[Array, Array, Array]:
    """Follow a reference from t_d for a time (negative: back); return times (k,), positions and velocities (k, n).

    Of all motions of the joints it is the one of least kinetic energy: none that the tip does not feel.
    """
    count = round(abs(span_s) / _STEP_S)
    h = span_s / count
    q, t_d = q_d.copy(), float(reference.times_s[1])
    rows = []
    for k in range(count + 1):
        t = t_d + k * h
        x, dx, _ = reference.at(t, post=post)
        inverse = consistent_inverse(dynamics.mass_matrix(q), dynamics.jacobian(q))
        dq = inverse @ dx
        rows.append((t, q, dq))
        off = _pose_error(dynamics, q, x[:3], turned(x[3:], FACE_DOWN))
        half = q + 0.5 * h * dq + abs(h) * _PULL * (inverse @ off)
        middle = reference.at(t + 0.5 * h, post=post)[1]
        q = q + h * consistent_inverse(dynamics.mass_matrix(half), dynamics.jacobian(half)) @ middle
        q = q + abs(h) * _PULL * (inverse @ off)
    times, places, speeds = (np.array(column) for column in zip(*rows, strict=True))
    return times, places, speeds
