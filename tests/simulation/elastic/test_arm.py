"""Any arm with elastic joints."""

from dataclasses import replace

import numpy as np
import pytest

from tactful import Robot
from tactful.dynamics import Dynamics
from tactful.errors import TactfulError
from tactful.impacts import CompliantContactConfig, ContactPoint
from tactful.simulation.elastic import ElasticArm, Plane
from tactful.simulation.planar import ArmConfig, PlanarConfig, inverse_kinematics, planar_robot
from tactful.simulation.planar._arm import absolute
from tactful.simulation.planar._dynamics import plant_record, step

PANDA = replace(
    Robot.load("panda"),
    stiffness=np.array([14e3, 14e3, 12e3, 12e3, 8e3, 8e3, 8e3]),
    damping=np.full(7, 8.0),
    motor_inertia=np.array([0.6, 0.6, 0.5, 0.5, 0.2, 0.2, 0.2]),
    coulomb_friction=np.zeros(7),
    viscous_friction=np.zeros(7),
)


def test_agrees_with_mujoco() -> None:
    """MuJoCo with a second hinge in every joint is an independent model of the same equations."""
    mujoco = pytest.importorskip("mujoco")
    spec = mujoco.MjSpec.from_string(PANDA.to_mjcf())
    spec.option.timestep = 2e-5
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_RK4
    for i, name in enumerate(PANDA.joint_names):
        motor = spec.joint(name)
        motor.limited = False
        # Before the motor's hinge MuJoCo has the motor; behind it, the spring turns the link.
        spec.body(PANDA.link_names[i]).add_joint(
            name=f"{name}_spring",
            type=mujoco.mjtJoint.mjJNT_HINGE,
            axis=motor.axis,
            pos=motor.pos,
            stiffness=PANDA.stiffness[i],
            damping=PANDA.damping[i],
        )
    model = spec.compile()
    data = mujoco.MjData(model)
    motors = [model.joint(name).qposadr[0] for name in PANDA.joint_names]
    springs = [model.joint(f"{name}_spring").qposadr[0] for name in PANDA.joint_names]
    arm = ElasticArm(PANDA, step_s=1e-4)
    rng = np.random.default_rng(0)
    dq = 0.5 * rng.normal(size=7)
    arm.reset(PANDA.home, dq)
    data.qpos[motors] = arm.theta
    data.qpos[springs] = arm.q - arm.theta
    data.qvel[motors] = dq
    u = arm.holding + rng.normal(size=7)
    data.qfrc_applied[motors] = u
    for _ in range(5000):
        mujoco.mj_step(model, data)
    arm.step(u, 0.1)
    np.testing.assert_allclose(data.qpos[motors] + data.qpos[springs], arm.q, atol=1e-7)
    np.testing.assert_allclose(data.qvel[motors] + data.qvel[springs], arm.dq, atol=1e-5)
    np.testing.assert_allclose(data.qpos[motors], arm.theta, atol=1e-7)


def test_energy_balance() -> None:
    """What the motors and gravity put in, less what the dampers take, is what motion and springs have."""
    arm = ElasticArm(PANDA, step_s=1e-4)
    arm.reset(PANDA.home, 0.3 * np.ones(7))
    u = arm.holding + 2.0
    dynamics = Dynamics(PANDA)
    before, work, h = arm.kinetic_and_elastic_j, 0.0, 1e-4
    power = _power(arm, dynamics, u)
    for _ in range(2000):
        arm.step(u, h)
        last, power = power, _power(arm, dynamics, u)
        work += 0.5 * h * (last + power)
    assert arm.kinetic_and_elastic_j - before == pytest.approx(work, abs=1e-4)
    assert abs(work) > 0.1


def _power(arm: ElasticArm, dynamics: Dynamics, u: np.ndarray) -> float:
    slip = arm.dtheta - arm.dq
    return float(u @ arm.dtheta - arm.dq @ dynamics.gravity(arm.q) - slip @ (PANDA.damping * slip))


def test_agrees_with_the_planar_kernels_through_an_impact() -> None:
    """Two codes for one equation, with two contact points and friction on an incline."""
    contact = CompliantContactConfig(stiffness=1e6, friction=0.2)
    config = PlanarConfig(arm=ArmConfig(coulomb_nm=(1.0, 1.0, 0.5), viscous_nms=(0.5, 0.5, 0.5)), contact=contact)
    robot, beta = planar_robot(config.arm), np.radians(3.0)
    normal = (-np.sin(beta), np.cos(beta), 0.0)
    points = [ContactPoint(2, [0.22, s, 0.0], [0.0, 1.0, 0.0]) for s in config.arm.offsets_m]
    arm = ElasticArm(robot, points, Plane((0.3, -0.05, 0.0), normal), contact, step_s=2e-5)
    q = inverse_kinematics(config.arm, np.array([0.3, -0.042, -np.pi / 2]))
    dq = np.array([-0.5, 0.2, -0.1])
    arm.reset(q, dq)
    plant = plant_record(config)[0]
    plant["surface"], plant["normal"] = (0.3, -0.05), normal[:2]
    plant["state"][:12] = np.r_[absolute(q), absolute(dq), arm.theta, arm.dtheta]
    u, pressed = arm.holding, False
    for _ in range(60):
        arm.step(u, 1e-3)
        left = 1e-3
        while left > 1e-9:
            left -= step(plant, u, left, 2e-5, 2e-5)
        pressed |= bool((arm.force[:, 1] > 10).any())
        np.testing.assert_allclose(absolute(arm.dq), plant["state"][3:6], atol=2e-4)
    assert pressed
    np.testing.assert_allclose(absolute(arm.q), plant["state"][:3], atol=1e-5)
    np.testing.assert_allclose(arm.theta, plant["state"][6:9], atol=1e-5)


def test_bad_input() -> None:
    """One line says what is wrong."""
    bare = replace(PANDA, stiffness=np.full(7, np.nan))
    point = ContactPoint(6, [0.0, 0.0, 0.1], [0.0, 0.0, 1.0])
    with pytest.raises(TactfulError, match="stiffness"):
        ElasticArm(bare)
    with pytest.raises(TactfulError, match="no plane"):
        ElasticArm(PANDA, [point])
    with pytest.raises(TactfulError, match="links 0 to 6"):
        ElasticArm(PANDA, [ContactPoint(7, [0.0, 0.0, 0.1], [0.0, 0.0, 1.0])], Plane((0.0, 0.0, 0.0)))
    with pytest.raises(TactfulError, match="step_s"):
        ElasticArm(PANDA, step_s=0.0)
    with pytest.raises(TactfulError, match="shape"):
        ElasticArm(PANDA).step(np.zeros(6), 0.1)
    with pytest.raises(TactfulError, match="shapes"):
        ElasticArm(PANDA).reset(np.zeros(6))
