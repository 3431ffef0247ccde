"""The Cartesian impedance controller against closed forms, and what it may never do."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tactful.config import ConfigError
from tactful.control import CartesianImpedance, ImpedanceConfig, Pose
from tactful.dynamics import Dynamics
from tactful.errors import TactfulError
from tactful.robots import Frame, Robot

PANDA = Robot.load("panda")
DYNAMICS = Dynamics(PANDA)
SPRING = ImpedanceConfig(posture_stiffness_nm_rad=0.0, posture_damping_nms_rad=0.0, torque_rate_nm_s=None)


@pytest.fixture
def q() -> np.ndarray:
    """A pose that is no special case."""
    return PANDA.home + np.array([0.3, 0.1, -0.2, 0.15, 0.2, -0.1, 0.4])


def test_no_torque_at_the_reference() -> None:
    """At the reference, at rest and in its posture nothing pulls: any torque would make the arm drift."""
    torque = CartesianImpedance(PANDA).torque(PANDA.home, np.zeros(7), *DYNAMICS.pose(PANDA.home))
    np.testing.assert_allclose(torque, 0, atol=1e-12)


def test_torque_is_that_of_spring_and_damper(q: np.ndarray) -> None:
    """(1)-(3) in closed form: K on both errors, B against the velocity, C dq; the moment goes with sin(angle / 2)."""
    dq = np.array([0.1, -0.2, 0.3, 0.1, -0.4, 0.2, 0.5])
    R, p = DYNAMICS.pose(q)
    J = DYNAMICS.jacobian(q)
    shift, axis, angle = np.array([0.02, -0.03, 0.01]), np.array([2.0, -1.0, 2.0]) / 3, 0.5
    torque = CartesianImpedance(PANDA, SPRING).torque(
        q, dq, Rotation.from_rotvec(angle * axis).as_matrix() @ R, p + shift
    )
    twist = J @ dq
    force = 150 * shift - 2 * np.sqrt(150) * twist[:3]
    moment = 10 * np.sin(angle / 2) * axis - 2 * np.sqrt(10) * twist[3:]
    expected = J.T @ np.concatenate([force, moment]) + DYNAMICS.coriolis(q, dq)
    np.testing.assert_allclose(torque, expected, atol=1e-9)


def test_gravity_is_an_option(q: np.ndarray) -> None:
    """A Panda compensates gravity itself, so adding it would push the arm up; an arm that does not needs it."""
    pose = DYNAMICS.pose(q)
    config = SPRING.model_copy(update={"gravity": True})
    torque = CartesianImpedance(PANDA, config, posture=q).torque(q, np.zeros(7), *pose)
    np.testing.assert_allclose(torque, DYNAMICS.gravity(q), atol=1e-9)


def test_posture_leaves_the_tip_alone(q: np.ndarray) -> None:
    """What holds the elbow must be orthogonal to every force at the tip, or it would shift the tip's equilibrium."""
    config = ImpedanceConfig(torque_rate_nm_s=None)
    dq = np.linspace(-0.3, 0.3, 7)
    pose = DYNAMICS.pose(q)
    torque = CartesianImpedance(PANDA, config).torque(q, dq, *pose)
    without = CartesianImpedance(PANDA, SPRING).torque(q, dq, *pose)
    assert np.abs(torque - without).max() > 0.1
    np.testing.assert_allclose(DYNAMICS.jacobian(q) @ (torque - without), 0, atol=1e-6)


def test_six_joints_have_no_posture() -> None:
    """With six joints the tip's pose fixes the posture: there is nothing to hold, and nothing may be added."""
    arm = Robot.load("ur5e")
    dynamics = Dynamics(arm)
    R, p = dynamics.pose(arm.home)
    controller = CartesianImpedance(arm, ImpedanceConfig(torque_rate_nm_s=None), posture=arm.home + 0.5)
    torque = controller.torque(arm.home, np.zeros(6), R, p + np.array([0.0, 0.1, 0.0]))
    np.testing.assert_allclose(torque, dynamics.jacobian(arm.home)[1] * 15.0, atol=1e-9)


def test_energy_decays() -> None:
    """A spring and a damper may not feed the arm: from rest, kinetic and elastic energy only fall."""
    q, dq = PANDA.home.copy(), np.zeros(7)
    R, p = DYNAMICS.pose(q)
    target = Pose(Rotation.from_rotvec([0.1, 0.2, -0.1]).as_matrix() @ R, p + np.array([0.03, 0.02, -0.04]))
    config = SPRING.model_copy(update={"posture_damping_nms_rad": 3.0, "gravity": True})
    controller = CartesianImpedance(PANDA, config)
    h = 0.001
    energy = []
    for k in range(1500):
        if k % 50 == 0:
            rotation, position = DYNAMICS.pose(q)
            cos_half = np.cos(Rotation.from_matrix(target.rotation @ rotation.T).magnitude() / 2)
            elastic = 75 * np.sum((target.position_m - position) ** 2) + 20 * (1 - cos_half)
            energy.append(elastic + dq @ DYNAMICS.momentum(q, dq) / 2)
        torque = controller.torque(q, dq, *target)
        dq = dq + h * np.linalg.solve(DYNAMICS.mass_matrix(q), torque - DYNAMICS.inverse_dynamics(q, dq, np.zeros(7)))
        q = q + h * dq
    assert np.all(np.diff(energy) < 1e-6)
    assert energy[-1] < 0.1 * energy[0]


def test_torque_and_its_rate_are_limited() -> None:
    """An arm stops itself when a command leaves its limits, as libfranka does at 1000 Nm/s."""
    R, p = DYNAMICS.pose(PANDA.home)
    far = Pose(R, p + 3.0)
    controller = CartesianImpedance(PANDA)
    controller.torque(PANDA.home, np.zeros(7), R, p)
    before = np.zeros(7)
    for _ in range(200):
        torque = controller.torque(PANDA.home, np.zeros(7), *far)
        assert np.all(np.abs(torque - before) <= 1.0 + 1e-12)
        before = torque
    assert np.all(np.abs(before) <= PANDA.torque_limit)
    assert np.any(np.abs(before) == PANDA.torque_limit)
    controller.reset()
    np.testing.assert_array_equal(controller.torque(PANDA.home, np.zeros(7), *far), before)


def test_compiled_before_the_loop() -> None:
    """A loop at 1 kHz cannot wait for a compiler: after `warm_up` the first call compiles nothing."""
    from tactful.control._cartesian_impedance import _control

    controller = CartesianImpedance(PANDA)
    controller.warm_up()
    compiled = len(_control.signatures)
    controller.torque(PANDA.home, np.zeros(7), *DYNAMICS.pose(PANDA.home))
    assert len(_control.signatures) == compiled


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"q": np.zeros(6)}, r"q has shape \(6,\), but panda needs \(7,\)"),
        ({"dq": 0.0}, r"dq has shape \(\), but panda needs \(7,\)"),
        ({"rotation": np.eye(2)}, r"R_d has shape \(2, 2\)"),
        ({"position_m": np.array([0, np.nan, 0])}, "panda: x_d is not finite"),
    ],
)
def test_bad_argument_is_named(changed: dict[str, object], message: str) -> None:
    """A torque from half a state must not reach an arm; the error names the argument and the controller goes on."""
    R, p = DYNAMICS.pose(PANDA.home)
    good = {"q": PANDA.home, "dq": np.zeros(7), "rotation": R, "position_m": p}
    controller = CartesianImpedance(PANDA)
    with pytest.raises(TactfulError, match=message):
        controller.torque(**(good | changed))
    assert np.abs(controller.torque(**good)).max() < 1e-9


def test_bad_settings_are_refused() -> None:
    """Mistakes show where the controller is built, not on the arm."""
    with pytest.raises(ConfigError, match="did you mean 'stiffness_n_m'"):
        ImpedanceConfig(stifness_n_m=100)
    with pytest.raises(ConfigError, match="stiffness_n_m"):
        ImpedanceConfig(stiffness_n_m=-1)
    with pytest.raises(TactfulError, match="needs 7 finite numbers"):
        CartesianImpedance(PANDA, posture=[0.0])
    fixed = replace(PANDA, frames={"base": Frame(-1, np.eye(3), np.zeros(3))}, tip="base")
    with pytest.raises(TactfulError, match="fixed to the base"):
        CartesianImpedance(fixed)
