"""Impacts of an arm with a flat tool on a platform."""

from functools import cache

import numpy as np
import pytest

pytest.importorskip("mujoco")

from tactful.classification import AimAwareConfig
from tactful.dynamics import Dynamics
from tactful.errors import TactfulError
from tactful.estimation import ObserverConfig
from tactful.impacts import simultaneous_inelastic
from tactful.monitor import Monitor, MonitorConfig
from tactful.robots import Robot
from tactful.simulation import SensorConfig
from tactful.simulation.impact_bench import (
    BenchConfig,
    BenchTaskConfig,
    FlatToolConfig,
    Strike,
    flat_tool,
    plan_strike,
    strike,
)

IDEAL = BenchConfig(
    sensors=SensorConfig.exact(),
    model_error=0.0,
    height_sd_m=0.0,
    inclination_sd_deg=0.0,
    cell=BenchConfig().cell.model_copy(update={"friction": 0.001}),
)
PLAN = plan_strike(110.0, IDEAL)


@cache
def _strike(beta_deg: float, ideal: bool = True, seed: int = 0) -> Strike:
    return strike(PLAN, beta_deg, IDEAL if ideal else BenchConfig(), seed)


def test_plan_joins_task_and_joints() -> None:
    """At t_d the face lies on the platform; the joints follow the tip's reference, from rest on, past the impact."""
    robot, plan = PLAN.robot, PLAN.impact
    dynamics = Dynamics(robot)
    rotation, place = dynamics.pose(plan.q_d)
    np.testing.assert_allclose(place, [0.51, 0.0, 0.15], atol=1e-9)
    np.testing.assert_allclose(rotation[:, 2], [0, 0, -1], atol=1e-9)
    np.testing.assert_allclose(plan.dq_d(plan.t_d_s), PLAN.dq_plus, atol=1e-9)
    np.testing.assert_allclose(dynamics.pose(PLAN.q_start)[1], PLAN.reference.at(0.0, post=False)[0][:3], atol=1e-5)
    assert plan.post_q is not None
    numeric = np.gradient(plan.post_q, plan.post_t_s, axis=0)
    np.testing.assert_allclose(plan.post_dq[5:-5], numeric[5:-5], atol=2e-4)
    for k in (0, 100, -1):
        x, dx, _ = PLAN.reference.at(float(plan.post_t_s[k]), post=True)
        np.testing.assert_allclose(dynamics.pose(plan.post_q[k])[1], x[:3], atol=1e-5)
        np.testing.assert_allclose(dynamics.jacobian(plan.post_q[k]) @ plan.post_dq[k], dx, atol=1e-4)


def test_four_feet_are_three_constraints() -> None:
    """Four points of a plane depend on each other; the map of three of them, as equations, says the same."""
    robot, q = PLAN.robot, PLAN.impact.q_d
    dynamics = Dynamics(robot, motor_inertia=True)
    rotation, place = dynamics.pose(q)
    face = robot.frames["face"]
    rows = []
    for contact in PLAN.impact.contacts:
        at = place + rotation @ face.rotation.T @ (contact.point_m - face.translation)
        assert at[2] == pytest.approx(0.15, abs=1e-9)
        rows.append(dynamics.jacobian_at(q, contact.link, at)[2])
    three = simultaneous_inelastic(dynamics.mass_matrix(q), PLAN.dq_minus, rows[:3])
    np.testing.assert_allclose(PLAN.dq_plus, three.dq_plus, atol=1e-8)
    np.testing.assert_allclose(np.array(rows) @ PLAN.dq_plus, 0, atol=1e-8)


def test_an_impact_as_planned() -> None:
    """It comes in time, the controller sees it, and when its joints have calmed the arm moves as the map said."""
    run = _strike(0.0)
    assert run.touch_s == pytest.approx(0.7, abs=4e-3)
    assert 0 <= run.detected_s[0] - run.touch_s <= 3e-3
    assert np.abs(run.tau_ext[run.t < 0.69]).max() == 0.0
    calm = (run.t > 0.78) & (run.t < 0.85)
    reference = np.array([run.plan.impact.dq_d(t) for t in run.t[calm]])
    np.testing.assert_allclose(run.dq[calm].mean(axis=0), reference.mean(axis=0), atol=0.08)


def test_residual_is_the_external_torque() -> None:
    """Model, sensors and observer agree: behind its low-pass the residual is what the platform does."""
    run = _strike(0.0)
    h, K = 1e-3, 50.0
    slow = np.zeros(7)
    for tau_ext, r in zip(run.tau_ext, run.r, strict=True):
        slow = slow + (1 - np.exp(-K * h)) * (tau_ext - slow)
        assert np.abs(r - slow).max() < 0.15 * max(np.abs(run.tau_ext).max(), 1.0)
    late = run.t > 0.9
    np.testing.assert_allclose(run.r[late].mean(axis=0), run.tau_ext[late].mean(axis=0), atol=2.0)


def test_an_edge_lands_first_on_an_inclined_platform() -> None:
    """The farther edge touches where the far side is raised: earlier by its height over the speed of the tool."""
    beta = 4.0
    run = _strike(beta)
    reach, angle = FlatToolConfig().half_length_m, np.radians(110.0)
    early = reach * np.tan(np.radians(beta)) / (0.3 * (np.sin(angle) + np.cos(angle) * np.tan(np.radians(beta))))
    assert 0.7 - run.touch_s == pytest.approx(early, abs=5e-3)
    assert _strike(-beta).touch_s < 0.69


def test_noise_comes_from_the_seed() -> None:
    """The same seed is the same run, another is another run of the same arm."""
    one, other = _strike(0.0, False, 1), _strike(0.0, False, 2)
    again = strike(PLAN, 0.0, BenchConfig(), 1)
    np.testing.assert_array_equal(one.q, again.q)
    np.testing.assert_array_equal(one.tau, again.tau)
    assert np.abs(one.q - other.q).max() > 1e-5
    assert np.abs(one.q - other.q).max() < 0.05


def test_the_monitor_tells_it() -> None:
    """The monitor has the plan and the samples of a noisy arm: expected as planned, unexpected on an incline."""
    bench = BenchConfig()
    aim = AimAwareConfig.table2(
        "wide", impact=bench.impact, bandwidth_hz=bench.observer_gain / (2 * np.pi), e_m_rad_s=0.3
    )
    config = MonitorConfig(aim_aware=aim, observer=ObserverConfig())
    for beta, kind in ((0.0, "expected_impact"), (10.0, "unexpected_impact")):
        run = _strike(beta, False, 1)
        monitor = Monitor(PLAN.robot, config, plan=PLAN.impact)
        told = [event for row in zip(run.t, run.q, run.dq, run.tau, strict=True) if (event := monitor.update(*row))]
        assert [event.kind for event in told if event.kind.endswith("impact")][-1] == kind


def test_any_arm_with_known_stiffness() -> None:
    """Nothing is made for the Panda: a FR3 strikes as planned, too."""
    bench = BenchConfig(robot="fr3", sensors=SensorConfig.exact(), model_error=0.0)
    run = strike(plan_strike(100.0, bench), 0.0, bench)
    assert run.touch_s == pytest.approx(0.7, abs=0.01)
    assert len(run.detected_s)


def test_tool_adds_its_mass() -> None:
    """The tool hangs on the flange with its mass, and touches with four feet."""
    bare, armed = Robot.load("panda"), flat_tool(Robot.load("panda"))
    assert armed.mass.sum() - bare.mass.sum() == pytest.approx(FlatToolConfig().mass_kg)
    assert len(armed.capsules) == len(bare.capsules) + 4
    assert armed.tip == "face"


def test_bad_input() -> None:
    """One line says what is wrong."""
    with pytest.raises(TactfulError, match="cannot reach"):
        plan_strike(110.0, BenchConfig(task=BenchTaskConfig(x_m=2.0)))
