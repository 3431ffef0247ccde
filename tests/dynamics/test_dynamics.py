"""Dynamics against Pinocchio, against MuJoCo, against a closed form, and against the laws of mechanics."""

from __future__ import annotations

import copy
import pickle
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose
from numpy.typing import NDArray

from tactful.dynamics import Dynamics, arm_record, kernels, motion_record
from tactful.errors import TactfulError
from tactful.robots import Frame, Robot, UnknownFrameError
from tests.dynamics._oracles import MujocoArm, PinocchioArm, make_arm, random_inertia, random_rotation, states

Array = NDArray[np.float64]

MADE = {
    kinds: make_arm(kinds, np.random.default_rng(i)) for i, kinds in enumerate(("RPRPRR", "PRRPPR", "PPPRRP", "RRRRRR"))
}
ARMS = (*Robot.names(), *MADE)
TOLERANCE = {"rtol": 1e-10, "atol": 1e-10}


@cache
def arm(name: str) -> Robot:
    """A built-in arm, or one of those made by hand: prismatic joints, axes and gravity askew."""
    return MADE.get(name) or Robot.load(name)


def assert_agree(ours: list[dict[str, Array]], theirs: list[dict[str, Array]]) -> None:
    """Compare each quantity over all states."""
    for quantity in theirs[0]:
        pair = (np.array([state[quantity] for state in states_]) for states_ in (ours, theirs))
        assert_allclose(*pair, **TOLERANCE, err_msg=quantity)


@pytest.mark.parametrize("motor_inertia", [True, False])
@pytest.mark.parametrize("name", ARMS)
class TestOracles:
    """500 random states of every arm, each against an implementation that shares no line with ours."""

    @staticmethod
    def ours(dynamics: Dynamics, q: Array, dq: Array, ddq: Array, link: int, point: Array) -> dict[str, Array]:
        return {
            "M": dynamics.mass_matrix(q),
            "p": dynamics.momentum(q, dq),
            "C dq": dynamics.coriolis(q, dq),
            "C^T dq": dynamics.coriolis_transposed(q, dq),
            "g": dynamics.gravity(q),
            "tau": dynamics.inverse_dynamics(q, dq, ddq),
            "J": dynamics.jacobian_at(q, link, point),
        }

    def test_agrees_with_pinocchio(self, name: str, motor_inertia: bool) -> None:
        """Pinocchio, fed the figures one by one, knows C(q, dq) too, which MuJoCo does not."""
        robot = arm(name)
        dynamics = Dynamics(robot, motor_inertia=motor_inertia)
        oracle = PinocchioArm(robot, motor_inertia=motor_inertia)
        ours, theirs = [], []
        for k, (q, dq, ddq) in enumerate(states(robot, 500)):
            link, point = k % robot.n, ddq[:3] / 10
            ours.append(self.ours(dynamics, q, dq, ddq, link, point))
            M, C = oracle.mass_matrix(q), oracle.coriolis(q, dq)
            theirs.append(
                {
                    "M": M,
                    "p": M @ dq,
                    "C dq": C @ dq,
                    "C^T dq": C.T @ dq,
                    "g": oracle.gravity(q),
                    "tau": oracle.inverse_dynamics(q, dq, ddq),
                    "J": oracle.jacobian(q, link, point),
                }
            )
        assert_agree(ours, theirs)

    def test_agrees_with_mujoco(self, name: str, motor_inertia: bool) -> None:
        """MuJoCo, fed the MJCF, shows that a simulation of the arm has the dynamics that the monitor assumes."""
        robot = arm(name)
        dynamics = Dynamics(robot, motor_inertia=motor_inertia)
        oracle = MujocoArm(robot, motor_inertia=motor_inertia)
        ours, theirs = [], []
        for k, (q, dq, ddq) in enumerate(states(robot, 500, seed=1)):
            link, point = k % robot.n, ddq[:3] / 10
            ours.append(self.ours(dynamics, q, dq, ddq, link, point))
            oracle.place(q, 0 * dq)
            g = oracle.data.qfrc_bias.copy()
            oracle.place(q, dq)
            M, bias = oracle.mass_matrix(), oracle.data.qfrc_bias
            J = oracle.jacobian(link, point)
            theirs.append({"M": M, "p": M @ dq, "C dq": bias - g, "g": g, "tau": M @ ddq + bias, "J": J})
        assert_agree(ours, theirs)


@pytest.mark.parametrize("name", ARMS)
def test_frames_are_where_mujoco_has_its_sites(name: str) -> None:
    """A tip in the wrong place gives a plausible, wrong force."""
    robot = arm(name)
    dynamics, oracle = Dynamics(robot), MujocoArm(robot, motor_inertia=True)
    for q, dq, _ in states(robot, 20):
        oracle.place(q, dq)
        for frame, at in robot.frames.items():
            site = oracle.data.site(frame)
            R, x = dynamics.pose(q, frame)
            assert_allclose(R, site.xmat.reshape(3, 3), atol=1e-12)
            assert_allclose(x, site.xpos, atol=1e-12)
            assert_allclose(dynamics.jacobian(q, frame), oracle.jacobian(at.link, site.xpos.copy()), atol=1e-12)
        assert_allclose(dynamics.jacobian(q), dynamics.jacobian(q, robot.tip), rtol=0, atol=0)


@pytest.mark.parametrize("name", ARMS)
def test_invariants(name: str) -> None:
    """What holds for every arm, whatever its figures: M is symmetric and positive, p = M dq, dM/dt = C + C^T."""
    robot = arm(name)
    dynamics = Dynamics(robot)
    h = 1e-6
    for q, dq, ddq in states(robot, 50, seed=2):
        M = dynamics.mass_matrix(q)
        assert np.array_equal(M, M.T)
        assert np.linalg.eigvalsh(M)[0] > 0
        assert_allclose(dynamics.momentum(q, dq), M @ dq, rtol=1e-12, atol=1e-12)
        C_dq, Ct_dq = dynamics.coriolis(q, dq), dynamics.coriolis_transposed(q, dq)
        assert_allclose(
            dynamics.inverse_dynamics(q, dq, ddq), M @ ddq + C_dq + dynamics.gravity(q), rtol=1e-11, atol=1e-11
        )
        dM_dq = (dynamics.momentum(q + h * dq, dq) - dynamics.momentum(q - h * dq, dq)) / (2 * h)
        assert_allclose(C_dq + Ct_dq, dM_dq, rtol=1e-6, atol=1e-6)
        assert dq @ (C_dq - Ct_dq) == pytest.approx(0, abs=1e-9)
        dT = [
            dq @ (dynamics.momentum(q + step, dq) - dynamics.momentum(q - step, dq)) / (4 * h)
            for step in h * np.eye(robot.n)
        ]
        assert_allclose(Ct_dq, dT, rtol=1e-6, atol=1e-6)


def with_coms(robot: Robot) -> Robot:
    """The arm with a frame in the centre of mass of every link."""
    coms = {f"com {i}": Frame(i, np.eye(3), robot.com[i]) for i in range(robot.n)}
    return replace(robot, frames={**robot.frames, **coms})


def potential_energy(dynamics: Dynamics, q: Array) -> float:
    """Return the potential energy [J] of an arm that has a frame in every centre of mass."""
    robot = dynamics.robot
    return -sum(robot.mass[i] * float(robot.gravity @ dynamics.pose(q, f"com {i}")[1]) for i in range(robot.n))


@pytest.mark.parametrize("name", ARMS)
def test_gravity_is_the_gradient_of_the_potential(name: str) -> None:
    """Ties g to forward kinematics alone, with gravity in any direction."""
    robot = with_coms(arm(name).with_gravity([3.0, -5.0, -8.0]))
    dynamics = Dynamics(robot)
    for q, _, _ in states(robot, 5, seed=3):
        gradient = [
            (potential_energy(dynamics, q + step) - potential_energy(dynamics, q - step)) / 2e-5
            for step in 1e-5 * np.eye(robot.n)
        ]
        assert_allclose(dynamics.gravity(q), gradient, rtol=1e-7, atol=1e-7)


@pytest.mark.parametrize("name", ["panda", "RPRPRR"])
def test_energy_is_conserved_in_free_motion(name: str) -> None:
    """M, C and g together: an arm that nothing drives keeps its energy, here over half a second with RK4."""
    robot = with_coms(arm(name))
    dynamics = Dynamics(robot)
    n, h = robot.n, 1e-3

    def energy(x: Array) -> float:
        q, dq = x[:n], x[n:]
        return float(dq @ dynamics.momentum(q, dq)) / 2 + potential_energy(dynamics, q)

    def rate(x: Array) -> Array:
        q, dq = x[:n], x[n:]
        bias = dynamics.inverse_dynamics(q, dq, np.zeros(n))
        return np.concatenate([dq, np.linalg.solve(dynamics.mass_matrix(q), -bias)])

    x = np.concatenate([robot.home, np.linspace(-1, 1, n)])
    before = energy(x)
    for _ in range(500):
        a = rate(x)
        b = rate(x + h / 2 * a)
        c = rate(x + h / 2 * b)
        x = x + h / 6 * (a + 2 * b + 2 * c + rate(x + h * c))
    assert np.abs(x[n:]).max() > 1, "it has to move"
    assert energy(x) == pytest.approx(before, abs=1e-6)


def test_gantry_has_the_closed_form() -> None:
    """Five slides that carry an eccentric rotor: small enough to write its energy down."""
    rng = np.random.default_rng(0)
    lever, J = 0.3, 0.05
    identity = np.broadcast_to(np.eye(3), (6, 3, 3))
    a = rng.standard_normal((6, 3))
    a /= np.linalg.norm(a, axis=1, keepdims=True)
    a[5] = [0, 0, 1]
    com = np.zeros((6, 3))
    com[5, 0] = lever
    robot = make_arm("PPPPPR", rng, rotation=identity, axis=a, com=com, inertia=J * identity)
    dynamics = Dynamics(robot, motor_inertia=False)
    m, gravity = robot.mass, robot.gravity
    for q, dq, _ in states(robot, 20):
        radial, tangent = [np.cos(q[5]), np.sin(q[5]), 0], [-np.sin(q[5]), np.cos(q[5]), 0]
        slides = np.cumsum(a[:5] * dq[:5, None], axis=0)  # (5, 3) velocity of the slides
        rotor = slides[4] + lever * dq[5] * np.array(tangent)  # (3,) velocity of its centre of mass
        momentum = np.vstack([m[:5, None] * slides, m[5] * rotor])  # (6, 3) of every body
        carried = np.cumsum(momentum[::-1], axis=0)[::-1]  # (6, 3) of every body and those that it carries
        weight = np.cumsum(m[::-1])[::-1]
        p = [*np.einsum("ij,ij->i", a, carried)[:5], lever * momentum[5] @ tangent + J * dq[5]]
        assert_allclose(dynamics.momentum(q, dq), p, atol=1e-12)
        dT_dq = [0] * 5 + [-m[5] * lever * dq[5] * (slides[4] @ radial)]
        assert_allclose(dynamics.coriolis_transposed(q, dq), dT_dq, atol=1e-12)
        g = [*(-weight * (a @ gravity))[:5], -m[5] * lever * (gravity @ tangent)]
        assert_allclose(dynamics.gravity(q), g, atol=1e-12)


@pytest.mark.parametrize("frame", ["flange", "hand_tcp"])
def test_payload_is_a_body_fixed_to_its_frame(frame: str) -> None:
    """The tool is lumped into a link; Pinocchio carries it as a body of its own."""
    rng = np.random.default_rng(4)
    panda = Robot.load("panda")
    com, inertia = np.array([0.02, -0.05, 0.11]), random_inertia(rng, 2.3)
    dynamics = Dynamics(panda.with_payload(2.3, com, inertia, frame=frame), motor_inertia=True)
    oracle = PinocchioArm(panda, motor_inertia=True)
    oracle.append(panda.frames[frame].link, 2.3, com, inertia, panda.frames[frame])
    oracle.data = oracle.model.createData()
    for q, dq, ddq in states(panda, 20):
        assert_allclose(dynamics.inverse_dynamics(q, dq, ddq), oracle.inverse_dynamics(q, dq, ddq), **TOLERANCE)
        assert_allclose(dynamics.momentum(q, dq), oracle.mass_matrix(q) @ dq, **TOLERANCE)
        assert_allclose(dynamics.gravity(q), oracle.gravity(q), **TOLERANCE)


def test_motor_inertia_counts_where_the_sensor_is() -> None:
    """Currents accelerate the rotors too; a sensor behind the gear does not see them."""
    panda = Robot.load("panda")
    behind, before = Dynamics(panda), Dynamics(replace(panda, torque_sensor="motor"))
    assert_allclose(
        before.mass_matrix(panda.home) - behind.mass_matrix(panda.home), np.diag(panda.motor_inertia), atol=1e-14
    )


@pytest.mark.parametrize("link", [-1, 0, 3])
def test_tip_position_of_the_kernel(link: int) -> None:
    """The monitor takes the tip's position from the kernel, not from `pose`; a tip may sit on any link or the base."""
    rng = np.random.default_rng(5)
    robot = replace(MADE["RPRPRR"], frames={"here": Frame(link, random_rotation(rng), rng.random(3))}, tip="here")
    arm_, motion, x, q = arm_record(robot)[0], motion_record(robot.n)[0], np.empty(3), rng.random(robot.n)
    kernels.place(arm_, motion, q)
    kernels.tip_position(arm_, motion, x)
    dynamics = Dynamics(robot)
    assert_allclose(x, dynamics.pose(q)[1], atol=1e-15)
    assert not dynamics.jacobian(q)[:, link + 1 :].any(), "joints beyond the link do not move it"


def test_results_are_the_callers_own() -> None:
    """A result that is a view of the scratch would change with the next call."""
    panda = Robot.load("panda")
    dynamics = Dynamics(panda)
    (q, dq, ddq), (q2, dq2, ddq2) = states(panda, 2)

    def everything(q: Array, dq: Array, ddq: Array) -> list[Array]:
        return [
            dynamics.momentum(q, dq),
            dynamics.coriolis_transposed(q, dq),
            dynamics.coriolis(q, dq),
            dynamics.gravity(q),
            dynamics.mass_matrix(q),
            dynamics.inverse_dynamics(q, dq, ddq),
            dynamics.jacobian(q),
            *dynamics.pose(q),
        ]

    first = everything(q, dq, ddq)
    kept = copy.deepcopy(first)
    for result in everything(q2, dq2, ddq2):
        result[:] = np.nan
    assert all(np.array_equal(a, b) for a, b in zip(first, kept, strict=True))
    assert all(np.array_equal(a, b) for a, b in zip(everything(q, dq, ddq), kept, strict=True))


def test_copies_and_pickles_are_independent() -> None:
    """Worker processes get the dynamics by pickle, and two threads need two scratch pads."""
    panda = Robot.load("panda")
    dynamics = Dynamics(panda, motor_inertia=True)
    (q, dq, _), (q2, dq2, _) = states(panda, 2)
    expected = dynamics.momentum(q, dq)
    for twin in (pickle.loads(pickle.dumps(dynamics)), copy.deepcopy(dynamics)):
        dynamics._momentum_terms(q, dq)
        twin.momentum(q2, dq2)
        assert np.array_equal(dynamics._motion["p"], expected)
        assert np.array_equal(twin.momentum(q, dq), expected)


def test_any_input_array_runs_the_one_compiled_kernel() -> None:
    """A robot's own `home` is read-only, which is another type to numba: seconds where 10 us are expected."""
    panda = Robot.load("panda")
    dynamics = Dynamics(panda)
    q = panda.home.copy()
    dynamics.inverse_dynamics(q, q, q)
    dynamics.jacobian_at(q, 6, np.zeros(3))
    used = (kernels.place, kernels.inverse_dynamics, kernels.jacobian)
    compiled = [len(kernel.signatures) for kernel in used]
    wide = np.zeros((7, 2))
    for odd in (panda.home, wide[:, 0], q.astype(np.float32), q.tolist(), list(range(7))):
        dynamics.inverse_dynamics(odd, odd, odd)
        dynamics.jacobian_at(odd, 6, np.asarray(odd)[:3])
    assert [len(kernel.signatures) for kernel in used] == compiled


@pytest.mark.parametrize("wrong", [np.zeros(6), np.zeros(8), np.zeros((1, 7)), 0.0, []])
@pytest.mark.parametrize("argument", ["q", "dq", "ddq"])
def test_wrong_shape_is_named(argument: str, wrong: Any) -> None:
    """The kernels do not check bounds: a short vector would be read beyond its end."""
    panda = Robot.load("panda")
    given = {"q": panda.home, "dq": np.zeros(7), "ddq": np.zeros(7)} | {argument: wrong}
    shape = np.shape(wrong)
    with pytest.raises(TactfulError) as caught:
        Dynamics(panda).inverse_dynamics(**given)
    assert str(caught.value) == f"{argument} has shape {shape}, but panda has 7 joints: pass 7 numbers"


@pytest.mark.parametrize("call", ["momentum", "coriolis_transposed", "coriolis"])
def test_wrong_velocity_is_refused_everywhere(call: str) -> None:
    """Every public verb checks."""
    panda = Robot.load("panda")
    with pytest.raises(TactfulError, match=r"dq has shape \(6,\)"):
        getattr(Dynamics(panda), call)(panda.home, np.zeros(6))


@pytest.mark.parametrize("verb", ["pose", "jacobian"])
def test_unknown_frame_suggests_the_nearest(verb: str) -> None:
    """A KeyError would not say which frames there are."""
    panda = Robot.load("panda")
    with pytest.raises(UnknownFrameError, match="did you mean 'flange'"):
        getattr(Dynamics(panda), verb)(panda.home, "flangee")


def test_wrong_link_or_point_is_refused() -> None:
    """A link that is not there would quietly have the Jacobian of the last one."""
    dynamics, q = Dynamics(Robot.load("panda")), np.zeros(7)
    for link in (7, -2):
        with pytest.raises(TactfulError, match=rf"panda has no link {link}: links are -1 \(base\) to 6"):
            dynamics.jacobian_at(q, link, np.zeros(3))
    with pytest.raises(TactfulError, match=r"point_m has shape \(2,\)"):
        dynamics.jacobian_at(q, 0, np.zeros(2))
    assert not dynamics.jacobian_at(q, -1, np.ones(3)).any()
