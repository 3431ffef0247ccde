"""The dynamics of the planar arm with elastic joints."""

import numpy as np
import pytest

from tactful.dynamics import Dynamics
from tactful.impacts import CompliantContactConfig
from tactful.simulation.planar import (
    ArmConfig,
    PlanarConfig,
    SurfaceConfig,
    forward_kinematics,
    inverse_kinematics,
    planar_robot,
)
from tactful.simulation.planar._arm import absolute, jacobian, point_jacobians
from tactful.simulation.planar._dynamics import STATE, derivative, plant_record, step

ARM = ArmConfig(coulomb_nm=(1.0, 0.8, 0.3), viscous_nms=(1.0, 0.5, 0.2))
CONFIG = PlanarConfig(arm=ARM, contact=CompliantContactConfig(friction=0.3))
RNG = np.random.default_rng(3)


def test_agrees_with_the_general_kernels() -> None:
    """(1) of the paper with M, C and g of the general arm: independent code for the same equation."""
    dynamics = Dynamics(planar_robot(ARM))
    plant = plant_record(CONFIG)[0]
    plant["surface"] = 0.0, -10.0
    K, D, B = (np.array(x) for x in (ARM.stiffness_nm_rad, ARM.damping_nms_rad, ARM.motor_inertia))
    for _ in range(20):
        q, dq, theta, dtheta, u = RNG.normal(size=(5, 3))
        tau = K * (theta - q) + D * (dtheta - dq)
        ddq = np.linalg.solve(dynamics.mass_matrix(q), tau - _bias(dynamics, q, dq))
        friction = np.array(ARM.viscous_nms) * dtheta + np.array(ARM.coulomb_nm) * np.tanh(dtheta / 0.01)
        state, slope = np.r_[absolute(q), absolute(dq), theta, dtheta, 0, 0], np.empty(STATE)
        derivative(plant, u, state, slope)
        np.testing.assert_allclose(slope[3:6], absolute(ddq), rtol=1e-9, atol=1e-6)
        np.testing.assert_allclose(slope[9:12], (u - tau - friction) / B, rtol=1e-9)


def _bias(dynamics: Dynamics, q: np.ndarray, dq: np.ndarray) -> np.ndarray:
    """C dq + g, from C^T dq and the change of M along the motion: C dq = dM/dt dq - C^T dq."""
    h = 1e-6
    change = (dynamics.mass_matrix(q + h * dq) - dynamics.mass_matrix(q - h * dq)) / (2 * h)
    return np.asarray(change @ dq - dynamics.coriolis_transposed(q, dq) + dynamics.gravity(q))


def test_contact_forces_act_through_their_jacobians() -> None:
    """tau_ext = J_N^T F_n + J_T^T F_t, with the Jacobians that the impact map uses."""
    plant = plant_record(CONFIG)[0]
    q = inverse_kinematics(ARM, np.array([0.3, -0.05, -np.pi / 2 + 0.001]))
    plant["surface"] = 0.3, -0.0495
    state, slope, free = np.r_[absolute(q), 0.1, -0.5, 0.2, q, np.zeros(5)], np.empty(STATE), np.empty(STATE)
    derivative(plant, np.zeros(3), state, slope)
    F_n, F_t, M = plant["F_n"][:2].copy(), plant["F_t"][:2].copy(), Dynamics(planar_robot(ARM)).mass_matrix(q)
    assert (F_n > 0).all()
    assert (np.abs(F_t) > 0).all()
    plant["surface"] = 0.0, -10.0
    derivative(plant, np.zeros(3), state, free)
    J_N, J_T = point_jacobians(ARM, q)
    change = np.diff(slope[3:6] - free[3:6], prepend=0.0)
    np.testing.assert_allclose(M @ change, J_N.T @ F_n + J_T.T @ F_t, rtol=1e-9)


def test_an_object_gives_way_to_what_the_tool_is_pushed_with() -> None:
    """The object obeys m ddz = -(sum of the tool's normal forces) - k z - d dz, also where it ends."""
    surface = SurfaceConfig(mass_kg=4.0, support_n_m=300.0, support_ns_m=20.0, end_m=0.05)
    plant = plant_record(PlanarConfig(surface=surface, contact=CompliantContactConfig(friction=0.3)))[0]
    z, dz = -0.004, -0.1
    q = inverse_kinematics(ARM, np.array([0.3, -0.05, -np.pi / 2 + 0.02]))
    normal = np.array([-np.sin(0.02), np.cos(0.02)])
    plant["normal"], plant["surface"] = normal, np.array([0.3, -0.05]) + (0.001 - z) * normal
    state, slope = np.r_[absolute(q), 0.1, -0.5, 0.2, q, 0, 0, 0, z, dz], np.empty(STATE)
    derivative(plant, np.zeros(3), state, slope)
    F_n = plant["F_n"]
    assert (F_n[[0, 3]] > 0).all()
    assert (F_n[[1, 2]] == 0).all()
    np.testing.assert_allclose(4.0 * slope[13], -F_n.sum() - 300.0 * z - 20.0 * dz, rtol=1e-9)
    assert slope[12] == dz


def test_kinematics() -> None:
    """Inverse after forward, and the Jacobian against differences."""
    for elbow, bend in (("up", -0.8), ("down", 0.8)):
        q = np.array([0.9, bend, -1.2])
        pose = forward_kinematics(ARM, q)
        np.testing.assert_allclose(inverse_kinematics(ARM, pose, elbow), q, atol=1e-12)
        h = 1e-6
        columns = [
            (forward_kinematics(ARM, q + h * e) - forward_kinematics(ARM, q - h * e)) / (2 * h) for e in np.eye(3)
        ]
        np.testing.assert_allclose(jacobian(ARM, q), np.array(columns).T, atol=1e-8)


def _energy(plant: np.void, state: np.ndarray, dynamics: Dynamics) -> float:
    q, dq = (np.diff(state[k : k + 3], prepend=0.0) for k in (0, 3))
    theta, dtheta = state[6:9], state[9:12]
    heights = np.array(plant["G"]) @ np.sin(state[:3])
    kinetic = 0.5 * dq @ dynamics.mass_matrix(q) @ dq + 0.5 * dtheta @ (np.array(plant["B"]) * dtheta)
    return float(kinetic + heights + 0.5 * (theta - q) @ (np.array(plant["K"]) * (theta - q)))


def test_energy_is_kept_without_damping() -> None:
    """A swinging arm that loses nothing keeps its energy to the accuracy of the integration."""
    arm = ArmConfig(damping_nms_rad=(0.0, 0.0, 0.0))
    plant, dynamics = plant_record(PlanarConfig(arm=arm))[0], Dynamics(planar_robot(arm))
    plant["surface"] = 0.0, -10.0
    q = np.array([0.5, -0.7, -0.3])
    plant["state"][:12] = np.r_[absolute(q), absolute([0.5, 0.3, -1.0]), q, 0, 0, 0]
    before = _energy(plant, plant["state"].copy(), dynamics)
    for _ in range(1000):
        step(plant, np.zeros(3), 5e-4, 5e-4, 1e-4)
    assert _energy(plant, plant["state"].copy(), dynamics) == pytest.approx(before, abs=2e-3)


def test_energy_only_falls_in_damped_joints_and_contacts() -> None:
    """Neither the contact law nor the friction may feed energy."""
    plant, dynamics = plant_record(CONFIG)[0], Dynamics(planar_robot(ARM))
    plant["surface"] = 0.3, -0.05
    q = inverse_kinematics(ARM, np.array([0.3, -0.049, -np.pi / 2 + 0.01]))
    plant["state"][:12] = np.r_[absolute(q), absolute([-0.5, -0.3, -0.2]), q, 0, 0, 0]
    last = _energy(plant, plant["state"].copy(), dynamics)
    touched = False
    for _ in range(300):
        left = 1e-3
        while left > 1e-9:
            left -= step(plant, np.zeros(3), left, 5e-4, 1e-4)
            touched |= bool((plant["gap"] < 0).any())
        stored = sum(2e7 * max(-gap, 0.0) ** 2.5 / 2.5 for gap in plant["gap"])
        now = _energy(plant, plant["state"].copy(), dynamics)
        assert now + stored < last + 2e-2
        last = now + stored
    assert touched
