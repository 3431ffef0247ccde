"""The momentum observer against the integral form on Pinocchio, against a simulation, and over long time."""

from __future__ import annotations

import copy
import math
import pickle
from dataclasses import replace
from typing import Any, Literal

import mujoco
import numpy as np
import pytest
from numpy.testing import assert_allclose
from numpy.typing import NDArray

from tactful.config import ConfigError
from tactful.dynamics import Dynamics
from tactful.errors import TactfulError
from tactful.estimation import MomentumObserver, ObserverConfig, _momentum_observer, external_wrench
from tactful.robots import Robot
from tests.dynamics._oracles import MujocoArm, PinocchioArm, make_arm

Array = NDArray[np.float64]
Rule = Literal["trapezoid", "euler"]

PANDA = Robot.load("panda")
ELASTIC = replace(PANDA, stiffness=[14e3] * 4 + [9e3] * 3, damping=np.linspace(30, 60, 7))
SLIDING = replace(
    make_arm("RPRPRR", np.random.default_rng(0), stiffness=[9e3] * 6, damping=[4.0] * 6), torque_sensor="motor"
)


def motion(robot: Robot, t: Array) -> tuple[Array, Array, Array]:
    """A smooth, fast motion about home with its velocity, and torques (k, n) that belong to nothing."""
    i = np.arange(robot.n)
    w, phase = 3.0 + i, 0.7 * i
    q = robot.home + 0.4 * np.sin(w * t[:, None] + phase)
    dq = 0.4 * w * np.cos(w * t[:, None] + phase)
    return q, dq, 20.0 * np.sin(5.0 * t[:, None] + i) + 5.0 * i


def irregular(count: int, seed: int = 0) -> Array:
    """Sampling times [s] with steps between 0.2 and 3 ms."""
    return np.cumsum(np.random.default_rng(seed).uniform(2e-4, 3e-3, count))


def by_integral(robot: Robot, config: ObserverConfig, t: Array, q: Array, dq: Array, tau: Array) -> Array:
    """The integral form, written down with Pinocchio: r = K_O (p - I - p(0)) + r(0), I the integral as it stands."""
    oracle = PinocchioArm(robot, motor_inertia=robot.torque_sensor == "motor")
    K = 2 * np.pi * np.broadcast_to(config.bandwidth_hz, robot.n)
    elastic = robot.damping / robot.stiffness if config.joint_flexibility else np.zeros(robot.n)
    friction = config.coulomb_nm * np.tanh(dq / config.coulomb_speed_rad_s) + np.array(config.viscous_nms) * dq
    tau = tau - config.bias_nm - friction
    p = np.array([oracle.mass_matrix(a) @ b for a, b in zip(q, dq, strict=True)])
    s = np.array([x + oracle.coriolis(a, b).T @ b - oracle.gravity(a) for x, a, b in zip(tau, q, dq, strict=True)])
    r = np.empty_like(q)
    r[0] = -s[0]
    integral = np.zeros(robot.n)
    for k in range(1, len(t)):
        h = t[k] - t[k - 1]
        integral = integral + elastic * (tau[k] - tau[k - 1])
        if config.integration == "euler":
            integral = integral + h * (s[k] + r[k - 1])
            r[k] = K * (p[k] - integral - p[0]) + r[0]
        else:  # r[k] stands on both sides
            known = integral + h / 2 * (s[k] + s[k - 1] + r[k - 1])
            r[k] = (K * (p[k] - known - p[0]) + r[0]) / (1 + K * h / 2)
            integral = known + h / 2 * r[k]
    return r


@pytest.mark.parametrize("integration", ["trapezoid", "euler"])
@pytest.mark.parametrize(
    ("robot", "settings"),
    [
        (PANDA, {}),
        (ELASTIC, {"joint_flexibility": True, "bandwidth_hz": (5, 10, 15, 20, 25, 30, 35)}),
        (SLIDING, {"joint_flexibility": True, "coulomb_nm": (0.3,) * 6, "viscous_nms": 0.2, "bias_nm": 1.5}),
        (Robot.load("ur5e"), {"bandwidth_hz": 60.0}),
    ],
    ids=["panda", "panda-elastic", "sliding", "ur5e"],
)
def test_agrees_with_the_integral_form(robot: Robot, settings: dict[str, Any], integration: Rule) -> None:
    """The incremental form must be the published one but for rounding, at irregular times, for every setting."""
    config = ObserverConfig(integration=integration, **settings)
    t = irregular(600)
    q, dq, tau = motion(robot, t)
    r = MomentumObserver(robot, config).run(t, q, dq, tau)
    assert_allclose(r, by_integral(robot, config, t, q, dq, tau), rtol=1e-9, atol=1e-9)


def test_elastic_term_is_that_of_equation_6() -> None:
    """The aim-aware paper has dtau_J/dt under the integral; with its analytic derivative the same r comes out."""
    t = np.arange(4000) * 2.5e-4
    q, dq, tau = motion(PANDA, t)
    dtau = 100.0 * np.cos(5.0 * t[:, None] + np.arange(7))
    explicit = tau + ELASTIC.damping / ELASTIC.stiffness * dtau
    rigid, elastic = ObserverConfig(), ObserverConfig(joint_flexibility=True)
    expected = MomentumObserver(ELASTIC, rigid).run(t, q, dq, explicit)
    r = MomentumObserver(ELASTIC, elastic).run(t, q, dq, tau)
    without = MomentumObserver(ELASTIC, rigid).run(t, q, dq, tau)
    settled = t > 0.2
    assert_allclose(r[settled], expected[settled], atol=1e-5)
    assert np.abs(without - expected)[settled].max() > 1e-2, "the term has to matter here"


def simulate(force_n: Array, start_s: float, stop_s: float, step_s: float = 2e-4) -> dict[str, Array]:
    """Move a Panda in MuJoCo under gravity compensation and soft control; from `start_s` on a force pulls its tip."""
    robot = replace(PANDA, motor_inertia=np.zeros(7))
    arm = MujocoArm(robot, motor_inertia=False)
    model, data = arm.model, arm.data
    model.opt.timestep = step_s
    data.qpos = robot.home
    tip = robot.frames[robot.tip]
    body = model.body(robot.link_names[tip.link]).id
    log: dict[str, list[Array]] = {key: [] for key in ("t", "q", "dq", "tau", "tau_ext")}
    for k in range(round(stop_s / step_s)):
        mujoco.mj_forward(model, data)
        wanted = robot.home + 0.3 * (1 - np.cos(4.0 * data.time))
        tau = data.qfrc_bias + 300 * (wanted - data.qpos) - 40 * data.qvel
        external = np.zeros(7)
        if k >= round(start_s / step_s):
            mujoco.mj_applyFT(model, data, force_n, np.zeros(3), data.site(robot.tip).xpos, body, external)
        row = {"t": data.time, "q": data.qpos, "dq": data.qvel, "tau": tau, "tau_ext": external}
        for key, value in row.items():
            log[key].append(np.array(value))
        data.qfrc_applied = tau + external
        mujoco.mj_step(model, data)
    return {key: np.array(value) for key, value in log.items()}


@pytest.fixture(scope="module")
def pulled() -> dict[str, Array]:
    """A Panda that moves; from 0.2 s on 40 N pull its flange."""
    return simulate(np.array([20.0, -30.0, 17.0]), 0.2, 0.6)


@pytest.mark.parametrize("integration", ["trapezoid", "euler"])
@pytest.mark.parametrize("bandwidth_hz", [5.0, 30.0, (5.0, 10.0, 20.0, 30.0, 40.0, 50.0, 60.0)])
def test_force_step_gives_a_first_order_response(
    pulled: dict[str, Array], bandwidth_hz: Any, integration: Rule
) -> None:
    """In a simulated motion, r is tau_ext, with its sign, behind a low-pass whose cut-off is the bandwidth."""
    t, tau_ext = pulled["t"], pulled["tau_ext"]
    observer = MomentumObserver(PANDA, ObserverConfig(bandwidth_hz=bandwidth_hz, integration=integration))
    r = observer.run(t, pulled["q"], pulled["dq"], pulled["tau"])
    K = 2 * np.pi * np.broadcast_to(bandwidth_hz, 7)
    h = t[1] - t[0]
    filtered = np.zeros_like(tau_ext)
    for k in range(1, len(t)):
        filtered[k] = filtered[k - 1] + (1 - np.exp(-K * h)) * (tau_ext[k - 1] - filtered[k - 1])
    assert np.abs(tau_ext).max() > 20
    assert np.abs(pulled["dq"]).max() > 1
    assert_allclose(r, filtered, atol=0.1 if integration == "trapezoid" else 0.25)


def test_force_at_the_tip_is_found(pulled: dict[str, Array]) -> None:
    """Observer and wrench together: what pulls the tip along +x is a force along +x, in newtons."""
    r = MomentumObserver(PANDA).run(*(pulled[key] for key in ("t", "q", "dq", "tau")))
    wrench = external_wrench(Dynamics(PANDA).jacobian(pulled["q"][-1]), r[-1])
    assert_allclose(wrench.force_n, [20.0, -30.0, 17.0], atol=0.5)
    assert_allclose(wrench.moment_nm, 0, atol=0.2)


@pytest.mark.parametrize("integration", ["trapezoid", "euler"])
@pytest.mark.parametrize("joint_flexibility", [True, False])
def test_start_and_reset_do_not_ring(integration: Rule, joint_flexibility: bool) -> None:
    """A bias, or a hand that already rests on the arm, is there from the first sample on and does not swing in."""
    observer = MomentumObserver(ELASTIC, ObserverConfig(integration=integration, joint_flexibility=joint_flexibility))
    bias = np.linspace(-3, 3, 7)
    q = np.tile(PANDA.home, (500, 1))
    tau = Dynamics(ELASTIC).gravity(ELASTIC.home) + bias
    for _ in range(2):
        r = observer.run(np.arange(500) * 1e-3, q, 0 * q, np.tile(tau, (500, 1)))
        assert_allclose(r, np.tile(-bias, (500, 1)), atol=1e-12)
        t = 1.0 + irregular(100)
        observer.run(t, *motion(PANDA, t))
        observer.reset()


def test_bias_and_friction_are_taken_from_the_torque() -> None:
    """What the sensor shows beyond the joint torque must not look like contact."""
    t = irregular(300)
    q, dq, tau = motion(PANDA, t)
    bias, coulomb, viscous = np.linspace(-2, 2, 7), np.linspace(0.1, 0.7, 7), np.linspace(0.5, 0.2, 7)
    config = ObserverConfig(
        bias_nm=tuple(bias), coulomb_nm=tuple(coulomb), viscous_nms=tuple(viscous), coulomb_speed_rad_s=0.05
    )
    measured = tau + bias + coulomb * np.tanh(dq / 0.05) + viscous * dq
    r = MomentumObserver(PANDA, config).run(t, q, dq, measured)
    assert_allclose(r, MomentumObserver(PANDA).run(t, q, dq, tau), atol=1e-10)


def test_motor_inertia_counts_for_currents_only() -> None:
    """Torque from currents accelerates the rotors too: a monitor without them would see contact in every start."""
    t = irregular(300)
    q, dq, tau = motion(PANDA, t)
    on_motor = MomentumObserver(replace(PANDA, torque_sensor="motor")).run(t, q, dq, tau)
    expected = MomentumObserver(PANDA).run(t, q, dq, tau)
    no_motors = replace(PANDA, torque_sensor="motor", motor_inertia=np.zeros(7))
    assert np.array_equal(MomentumObserver(no_motors).run(t, q, dq, tau), expected)
    assert np.abs(on_motor - expected).max() > 1


def test_a_million_samples_do_not_drift() -> None:
    """The integral form loses digits as its integral grows; after hours r must still be that of the last second."""
    h, period = 1e-3, 2 * np.pi
    t = np.arange(round(period / h)) * (period / round(period / h))
    q, dq, tau = motion(PANDA, t)
    observer, fresh = MomentumObserver(PANDA), MomentumObserver(PANDA)
    for k in range(160):
        r = observer.run(k * period + t, q, dq, tau)
    assert 160 * len(t) > 1_000_000
    assert_allclose(r[2000:], fresh.run(t, q, dq, tau)[2000:], atol=1e-8)


def test_euler_diverges_where_it_says_and_the_trapezoid_never() -> None:
    """The one reason, besides accuracy, not to take what most codes use."""
    t = np.arange(200) * 1e-3
    samples = motion(PANDA, t)
    for bandwidth_hz, stable in ((0.98e3 / np.pi, True), (1.02e3 / np.pi, False)):
        r = {
            rule: MomentumObserver(PANDA, ObserverConfig(bandwidth_hz=bandwidth_hz, integration=rule)).run(t, *samples)
            for rule in ("trapezoid", "euler")
        }
        apart = np.abs(r["euler"] - r["trapezoid"]).max(axis=1)
        assert (apart[-1] < apart[:20].max()) == stable
        assert np.abs(r["trapezoid"]).max() < 1e3


@pytest.mark.parametrize("settings", [{}, {"integration": "euler", "joint_flexibility": True}])
def test_stream_is_batch_bit_for_bit(settings: dict[str, Any]) -> None:
    """A recording judged offline must give what the robot would have seen online."""
    config = ObserverConfig(**settings)
    t = irregular(120)
    samples = motion(PANDA, t)
    batch, stream, pieces = (MomentumObserver(ELASTIC, config) for _ in range(3))
    expected = batch.run(t, *samples)
    streamed = [stream.update(*row) for row in zip(t, *samples, strict=True)]
    assert np.array_equal(streamed, expected)
    assert np.array_equal(stream.r, expected[-1])
    parts = [pieces.run(t[a:b], *(x[a:b] for x in samples)) for a, b in ((0, 1), (1, 1), (1, 70), (70, 120))]
    assert np.array_equal(np.concatenate(parts), expected)


def test_copies_and_pickles_go_on_where_they_are() -> None:
    """A running monitor can be stored and resumed; the copy must not write into the original."""
    t = irregular(100)
    samples = motion(PANDA, t)
    observer = MomentumObserver(PANDA)
    observer.run(t[:40], *(x[:40] for x in samples))
    twins = [pickle.loads(pickle.dumps(observer)), copy.deepcopy(observer)]
    rest = [t[40:], *(x[40:] for x in samples)]
    expected = observer.run(*rest)
    for twin in twins:
        assert np.array_equal(twin.run(*rest), expected)
    observer.r[:] = 0
    assert np.array_equal(observer.r, expected[-1]), "r is a copy"


def test_any_input_array_runs_the_one_compiled_kernel() -> None:
    """Numba compiles anew for read-only or strided arrays: seconds in the middle of a control loop."""
    observer = MomentumObserver(PANDA)
    observer.update(0.0, PANDA.home.copy(), np.zeros(7), np.zeros(7))
    compiled = len(_momentum_observer._run.signatures)
    wide = np.zeros((7, 2))
    for k, odd in enumerate((PANDA.home, wide[:, 0], PANDA.home.astype(np.float32), [0] * 7, (0.0,) * 7)):
        observer.update(k + 1, odd, odd, odd)
    observer.run(np.arange(10, 12), *(np.zeros((7, 2)).T for _ in range(3)))
    assert len(_momentum_observer._run.signatures) == compiled


@pytest.mark.parametrize("key", ["bandwidth_hz", "bias_nm", "coulomb_nm", "viscous_nms"])
@pytest.mark.parametrize("count", [0, 6, 8])
def test_wrong_number_of_settings_is_refused(key: str, count: int) -> None:
    """Settings for a UR5e must not be spread over a Panda."""
    with pytest.raises(ConfigError) as caught:
        MomentumObserver(PANDA, ObserverConfig(**{key: (1.0,) * count}))  # type: ignore[arg-type]
    problem = f"has {count} numbers; give one, or one for each of the 7 joints"
    assert str(caught.value) == f"config, observer.{key}: {problem}"
    assert (caught.value.key, caught.value.value) == (key, (1.0,) * count)


@pytest.mark.parametrize(
    "robot",
    [replace(ELASTIC, stiffness=np.full(7, np.nan)), replace(ELASTIC, stiffness=np.zeros(7))],
    ids=["nan", "zero"],
)
def test_elastic_term_needs_stiffness(robot: Robot) -> None:
    """Without stiffness and damping the term would be NaN, or left out without a word."""
    with pytest.raises(ConfigError, match=r"observer\.joint_flexibility: panda has no figures for the stiffness"):
        MomentumObserver(robot, ObserverConfig(joint_flexibility=True))


def test_elastic_term_needs_damping() -> None:
    """One joint without a figure is enough."""
    robot = replace(ELASTIC, damping=[1.0] * 6 + [math.nan])
    with pytest.raises(
        ConfigError, match="panda has no figures for the damping of its joints; give it some, or set this"
    ):
        MomentumObserver(robot, ObserverConfig(joint_flexibility=True))


@pytest.mark.parametrize("wrong", ["q", "dq", "tau"])
def test_samples_of_another_arm_are_refused(wrong: str) -> None:
    """The kernels do not check bounds."""
    observer = MomentumObserver(PANDA)
    rows = dict.fromkeys(("q", "dq", "tau"), np.zeros((4, 7)))
    for shape in ((4, 6), (4, 8), (3, 7), (5, 7), (4,), (4, 7, 1), ()):
        with pytest.raises(TactfulError) as caught:
            observer.run(np.arange(4.0), **rows | {wrong: np.zeros(shape)})
        assert str(caught.value) == f"{wrong} has shape {shape}, but 4 samples of 7 joints are (4, 7)"
    with pytest.raises(TactfulError, match=rf"{wrong} has shape \(1, 6\)"):
        observer.update(0.0, **dict.fromkeys(("q", "dq", "tau"), np.zeros(7)) | {wrong: np.zeros(6)})


@pytest.mark.parametrize("late", [0.5, 0.2, math.nan])
def test_time_that_does_not_advance_is_refused(late: float) -> None:
    """A repeated or backward time would integrate nothing, or backwards; a reset may begin at any time."""
    observer = MomentumObserver(PANDA)
    rows = (np.tile(PANDA.home, (3, 1)),) * 3
    observer.run([0.3, 0.4, 0.5], *rows)
    r = observer.r
    with pytest.raises(TactfulError, match=rf"t does not increase at sample 1, {late} s"):
        observer.run([0.6, late, 0.7], *rows)
    with pytest.raises(TactfulError, match="t does not increase at sample 0"):
        observer.update(late, *(row[0] for row in rows))
    assert np.array_equal(observer.r, r), "a refused sample leaves no trace"
    observer.reset()
    observer.update(-5.0, *(row[0] for row in rows))


@pytest.mark.parametrize("channel", range(3))
def test_sample_that_is_not_finite_shows_until_reset(channel: int) -> None:
    """An observer that swallowed a NaN would go on with a wrong integral; the monitor skips such samples before."""
    observer = MomentumObserver(PANDA)
    rows = [np.tile(PANDA.home, (6, 1)) for _ in range(3)]
    expected = MomentumObserver(PANDA).run(np.arange(6.0), *rows)
    rows[channel][2] = np.nan
    assert np.isnan(observer.run(np.arange(6.0), *rows)[2:]).all()
    observer.reset()
    rows[channel][2] = PANDA.home
    assert np.array_equal(observer.run(np.arange(6.0), *rows), expected)
