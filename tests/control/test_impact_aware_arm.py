"""The impact-aware controller of any serial arm."""

import numpy as np
import pytest

from tactful.control import ImpactAwareController, ImpactControlConfig, ReferenceSpreading
from tactful.control._impact_aware_arm import Phase, consistent_inverse
from tactful.dynamics import Dynamics
from tactful.errors import TactfulError
from tactful.robots import Robot
from tactful.simulation.impact_bench import BenchConfig, plan_strike
from tactful.simulation.impact_bench._plan import FACE_DOWN, NORMAL
from tactful.simulation.planar import PlanarConfig, plan_impact, planar_robot
from tactful.simulation.planar._dynamics import plant_record
from tactful.simulation.planar._loop import _control, loop_record

PHASES: tuple[Phase, ...] = ("ante", "interim", "post")


@pytest.mark.parametrize("phase", [0, 1, 2])
def test_agrees_with_the_planar_arm(phase: int) -> None:
    """Two codes for one law: the planar kernels have no Jacobian to invert, and three joints cannot move all six."""
    config = PlanarConfig(control=ImpactControlConfig(friction=0.2))
    plan, reference = plan_impact(80.0, 0.3, config)
    t, (x_d, dx_d, ddx_d) = 0.45, reference.at(0.45, post=phase > 0)
    plant, loop = plant_record(config)[0], loop_record(config)[0]
    q = plan.q_d + np.array([0.02, -0.01, 0.03])
    dq = np.array([0.3, -0.2, 0.4])
    loop["q"], loop["dq"], loop["x_d"], loop["dx_d"], loop["ddx_d"] = q, dq, x_d, dx_d, ddx_d
    _control(loop, plant, phase)
    robot = planar_robot(config.arm)
    tip, _ = Dynamics(robot).pose(plan.q_d)
    spread = np.zeros((2, 6, 6))
    spread[:, [0, 1, 5]] = reference.coefficients
    spread[:, 5, 0] += np.pi / 2  # the angle of the face, from where it lies on the surface
    controller = ImpactAwareController(
        robot, ReferenceSpreading(reference.times_s, spread), tip, (0.0, 1.0, 0.0), q, config.control
    )
    np.testing.assert_allclose(controller.torque(t, q, dq, PHASES[phase]), loop["u"], atol=2e-2)


def test_what_the_posture_does_is_not_felt_at_the_tip() -> None:
    """The seventh joint's freedom is for the posture: another posture accelerates the joints, but not the tip."""
    planned = plan_strike(110.0)
    robot, q = planned.robot, planned.q_start
    dynamics = Dynamics(robot, motor_inertia=True)
    dq = np.full(7, 0.2)
    u = [
        ImpactAwareController(robot, planned.reference, FACE_DOWN, NORMAL, q + shift).torque(0.3, q, dq, "ante")
        for shift in (0.0, 0.3)
    ]
    ddq = np.linalg.solve(dynamics.mass_matrix(q), u[1] - u[0])
    np.testing.assert_allclose(dynamics.jacobian(q) @ ddq, 0, atol=1e-9)
    assert np.abs(ddq).max() > 0.1


def test_follows_the_reference_exactly_without_disturbance() -> None:
    """On the reference the tip of a rigid arm accelerates as the reference does: feedforward is inverse dynamics."""
    planned = plan_strike(120.0)
    robot, q, t = planned.robot, planned.q_start, 0.0
    dynamics = Dynamics(robot, motor_inertia=True)
    controller = ImpactAwareController(robot, planned.reference, FACE_DOWN, NORMAL, planned.impact.q_d)
    dq, h = np.zeros(7), 1e-3
    for _ in range(600):
        u = controller.torque(t, q, dq, "ante")
        ddq = np.linalg.solve(dynamics.mass_matrix(q), u - dynamics.inverse_dynamics(q, dq, np.zeros(7)))
        q, dq, t = q + h * dq + 0.5 * h**2 * ddq, dq + h * ddq, t + h
    x = planned.reference.at(t, post=False)[0]
    np.testing.assert_allclose(dynamics.pose(q)[1], x[:3], atol=2e-4)
    np.testing.assert_allclose(dynamics.pose(q)[0], FACE_DOWN, atol=1e-3)


def test_presses_with_the_normal_force() -> None:
    """After the impact the height is left to the surface: where the tip is along the normal does not matter."""
    planned = plan_strike(110.0)
    robot, q = planned.robot, planned.impact.q_d
    config = BenchConfig().control
    dynamics = Dynamics(robot)
    J = dynamics.jacobian(q)
    higher = q + 0.01 * np.linalg.pinv(J)[:, 2]
    forces = []
    for place in (q, higher):
        controller = ImpactAwareController(robot, planned.reference, FACE_DOWN, NORMAL, place, config)
        rest = controller.torque(5.0, place, np.zeros(7), "post") - dynamics.gravity(place)
        forces.append(np.linalg.lstsq(dynamics.jacobian(place).T, rest, rcond=None)[0][2])
    assert forces[0] == pytest.approx(config.normal_force_n, abs=1.0)
    assert forces[1] == pytest.approx(forces[0], abs=1.0)


def test_inverse_leaves_out_what_the_tip_cannot_do() -> None:
    """Where the tip can move, J J^# is the identity; elsewhere it is zero."""
    robot = planar_robot()
    dynamics = Dynamics(robot, motor_inertia=True)
    q = np.array([1.2, -1.4, -1.0])
    J = dynamics.jacobian(q)
    able = np.diag([1.0, 1.0, 0.0, 0.0, 0.0, 1.0])
    np.testing.assert_allclose(J @ consistent_inverse(dynamics.mass_matrix(q), J), able, atol=1e-9)


def test_bad_input() -> None:
    """One line says what is wrong."""
    planned = plan_strike(110.0)
    with pytest.raises(TactfulError, match="expected 6"):
        ImpactAwareController(Robot.load("panda"), planned.reference, FACE_DOWN, NORMAL, np.zeros(6))
