"""Simulated impacts of the planar arm."""

import numpy as np
import pytest

from tactful.control import ImpactControlConfig
from tactful.dynamics import Dynamics
from tactful.errors import TactfulError
from tactful.impacts import CompliantContactConfig, impact
from tactful.simulation.planar import (
    ArmConfig,
    PlanarConfig,
    SensorsConfig,
    SurfaceConfig,
    TaskConfig,
    forward_kinematics,
    plan_impact,
    planar_robot,
    simulate_impact,
    simulate_impacts,
)
from tactful.simulation.planar._arm import jacobian, point_jacobians


def test_plan_joins_task_and_joints() -> None:
    """At t_d the plan is the pose that the task says; after it the tip moves along the surface, no point into it."""
    plan, reference = plan_impact(70.0, 0.34)
    np.testing.assert_allclose(forward_kinematics(ArmConfig(), plan.q_d), [0.34, -0.05, -np.pi / 2], atol=1e-12)
    J_N, _ = point_jacobians(ArmConfig(), plan.q_d)
    np.testing.assert_allclose(J_N @ plan.dq_d(plan.t_d_s), 0, atol=1e-12)
    tip = jacobian(ArmConfig(), plan.q_d) @ plan.dq_d(plan.t_d_s)
    np.testing.assert_allclose(tip, reference.at(0.5, post=True)[1], atol=1e-12)
    assert tip[0] > 0
    np.testing.assert_allclose(
        reference.at(0.5, post=False)[1],
        0.3 * np.array([np.cos(np.radians(70)), -np.sin(np.radians(70)), 0]),
        atol=1e-12,
    )
    assert plan.post_q is not None
    numeric = np.gradient(plan.post_q, plan.post_t_s, axis=0)
    np.testing.assert_allclose(plan.post_dq[5:-5], numeric[5:-5], atol=1e-4)


def test_friction_of_the_map_slows_the_slide() -> None:
    """The friction-aware reference leaves the impact slower along the surface."""
    smooth = plan_impact(60.0, 0.3)[1].at(0.5, post=True)[1]
    rough = plan_impact(60.0, 0.3, PlanarConfig(task=TaskConfig(friction=0.1)))[1].at(0.5, post=True)[1]
    assert 0 < rough[0] < smooth[0]


def test_an_impact_as_planned() -> None:
    """Both edges land at t_d with the planned speed, the controller sees it, and the arm settles on the reference."""
    run = simulate_impact(90.0, 0.3, 0.0)
    assert {touch.point for touch in run.touches[:2]} == {0, 1}
    for touch in run.touches[:2]:
        assert touch.time_s == pytest.approx(0.5, abs=1e-3)
        assert touch.speed_m_s == pytest.approx(0.3, abs=0.01)
    assert run.detected_s[0] == pytest.approx(0.5, abs=3e-3)
    late = run.t > 0.65
    error = run.dq[late] - np.array([run.plan.dq_d(t) for t in run.t[late]])
    assert np.abs(error).max() < 0.05
    assert run.force_n[-1, :, 0].sum() == pytest.approx(80.0, rel=0.15)


def test_before_the_impact_the_reference_is_followed() -> None:
    """A controller that lags would move t_d and the velocity before the impact."""
    run = simulate_impact(70.0, 0.34, 0.0)
    _, reference = plan_impact(70.0, 0.34)
    for k in (100, 300, 480):
        pose = forward_kinematics(ArmConfig(), run.q[k])
        np.testing.assert_allclose(pose, reference.at(run.t[k], post=False)[0], atol=2e-3)


@pytest.mark.parametrize(("beta", "first"), [(4.0, 1), (-4.0, 0)])
def test_on_an_incline_one_edge_lands_first(beta: float, first: int) -> None:
    """Its time and that of the second are those of the geometry: +-0.1 sin(beta) at 0.3 m/s."""
    run = simulate_impact(90.0, 0.3, beta)
    assert run.touches[0].point == first
    assert run.touches[0].time_s == pytest.approx(0.5 - 0.1 * np.tan(np.radians(4)) / 0.3, abs=2e-3)
    assert any(touch.point != first for touch in run.touches)
    assert run.detected_s[0] == pytest.approx(run.touches[0].time_s, abs=3e-3)


def test_residual_of_an_exact_model_is_the_true_torque() -> None:
    """tau_ext of the run is M ddq + C dq + g - tau - D K^-1 dtau: the observer of the package finds it."""
    from tactful.estimation import MomentumObserver, ObserverConfig

    run = simulate_impact(80.0, 0.3, 2.0)
    observer = MomentumObserver(planar_robot(), ObserverConfig(bandwidth_hz=30.0, joint_flexibility=True))
    r = observer.run(run.t, run.q, run.dq, run.tau)
    behind, gain = np.zeros(3), 2 * np.pi * 30.0 * 1e-3
    for k in range(1, len(run.t)):
        behind += gain * (run.tau_ext[k - 1] - behind) / (1 + gain / 2)
    np.testing.assert_allclose(r[-50:], behind + 0 * r[-50:], atol=8.0)
    assert np.abs(r[:400]).max() < 0.5


def test_neither_jobs_nor_company_matter() -> None:
    """A case is the same alone, among others and in a thread, with noise."""
    config = PlanarConfig(sensors=SensorsConfig(encoder_noise_rad=1e-5, torque_noise_nm=0.05, velocity_cutoff_hz=200.0))
    cases = [(80.0, 0.3, 1.0), (80.0, 0.3, -3.0), (100.0, 0.24, 0.0)]
    together, threads = simulate_impacts(cases, config, 7), simulate_impacts(cases, config, 7, jobs=2)
    alone = [simulate_impact(*case, config, 7) for case in cases]
    for runs in zip(together, threads, alone, strict=True):
        for other in runs[1:]:
            for name in ("q", "dq", "tau", "tau_ext", "force_n", "detected_s"):
                np.testing.assert_array_equal(getattr(runs[0], name), getattr(other, name))
    assert not np.array_equal(together[0].q, simulate_impact(*cases[0], config, 8).q)


def test_finer_steps_change_little() -> None:
    """The step is chosen by the contact's own rate."""
    coarse = simulate_impact(90.0, 0.3, 2.0)
    fine = simulate_impact(90.0, 0.3, 2.0, PlanarConfig(step_s=1e-4, contact_step_s=2e-5))
    assert np.abs(coarse.dq - fine.dq).max() < 1e-3


def test_a_ball_touches_with_one_point() -> None:
    """Single-contact impacts run through the same code."""
    run = simulate_impact(90.0, 0.3, 3.0, PlanarConfig(arm=ArmConfig(tip="ball")))
    assert run.force_n.shape[1] == 1 + 2
    assert (run.force_n[:, 1:] == 0).all()
    assert run.touches[0].time_s == pytest.approx(0.5, abs=2e-3)


@pytest.mark.parametrize(("side", "end", "tilt"), [("end_m", 3, -1), ("begin_m", 2, 1)])
def test_a_tool_beyond_the_end_of_a_surface_tips_over_its_edge(side: str, end: int, tilt: int) -> None:
    """Less than half of the face is held: the end of the surface carries it alone, and the tool turns about it."""
    run = simulate_impact(90.0, 0.3, 0.0, PlanarConfig(surface=SurfaceConfig(**{side: tilt * 0.04})))
    assert {touch.point for touch in run.touches[:2]} == {0 if tilt < 0 else 1, end}
    held = run.force_n[700:, :, 0].mean(axis=0)
    assert held[end] == pytest.approx(80.0, rel=0.1)
    assert np.delete(held, end) == pytest.approx(0.0, abs=1.0)
    turned = np.degrees(forward_kinematics(ArmConfig(), run.q[700])[2] + np.pi / 2)
    assert tilt * turned > 2.0


def test_a_surface_that_reaches_beyond_the_tool_has_no_end() -> None:
    """An end that nothing meets changes nothing."""
    endless = simulate_impact(80.0, 0.3, 2.0)
    reaching = simulate_impact(80.0, 0.3, 2.0, PlanarConfig(surface=SurfaceConfig(begin_m=-0.15, end_m=0.18)))
    np.testing.assert_array_equal(endless.q, reaching.q)


def test_the_object_takes_the_momentum_that_the_tool_loses() -> None:
    """Free of any support, its velocity is the impulse of the tool over its mass; very heavy, it is a fixed surface."""
    heavy = simulate_impact(90.0, 0.3, 0.0, PlanarConfig(surface=SurfaceConfig(mass_kg=1e7)))
    np.testing.assert_allclose(heavy.dq, simulate_impact(90.0, 0.3, 0.0).dq, atol=1e-3)
    stiff = CompliantContactConfig(stiffness=2e9, restitution=0.01)
    for mass in (2.0, 10.0):
        config = PlanarConfig(surface=SurfaceConfig(mass_kg=mass), contact=stiff, contact_step_s=1e-5, duration_s=0.501)
        run = simulate_impact(75.0, 0.3, 0.0, config)
        J_N, _ = point_jacobians(ArmConfig(), run.q[-1])
        M = np.zeros((4, 4))
        M[:3, :3], M[3, 3] = Dynamics(planar_robot()).mass_matrix(run.q[-1]), mass
        after = impact(M, np.append(run.dq[499], 0.0), np.column_stack([J_N, -np.ones(2)])).dq_plus
        assert (J_N @ run.dq[-1]).mean() == pytest.approx(after[3], rel=0.05)


def test_the_plan_of_an_object_shares_its_momentum() -> None:
    """The impulse along the normal that slows the arm is what the object takes with it, at the speed of the tip."""
    plan, _ = plan_impact(75.0, 0.3, PlanarConfig(task=TaskConfig(object_mass_kg=4.0)))
    J = jacobian(ArmConfig(), plan.q_d)
    M_r = Dynamics(planar_robot(), motor_inertia=True).mass_matrix(plan.q_d)
    before = 0.3 * np.array([np.cos(np.radians(75)), -np.sin(np.radians(75)), 0.0])
    after = J @ plan.dq_d(plan.t_d_s)
    impulse = np.linalg.solve(J.T, M_r @ np.linalg.solve(J, after - before))
    assert -0.3 < after[1] < 0
    np.testing.assert_allclose(impulse[:2], [0.0, -4.0 * after[1]], atol=1e-9)


def test_delay_and_friction_are_felt() -> None:
    """Each option changes the run, and the run stays bounded."""
    plain = simulate_impact(80.0, 0.3, 1.0)
    for config in (
        PlanarConfig(control=ImpactControlConfig(delay_samples=1)),
        PlanarConfig(control=ImpactControlConfig(interim_s=0.02)),
        PlanarConfig(arm=ArmConfig(coulomb_nm=(1.0, 1.0, 1.0), viscous_nms=(1.0, 1.0, 1.0))),
        PlanarConfig(contact=CompliantContactConfig(friction=0.2)),
        PlanarConfig(contact=CompliantContactConfig(restitution=0.3)),
    ):
        run = simulate_impact(80.0, 0.3, 1.0, config)
        assert np.abs(run.dq).max() < 5.0
        assert np.abs(run.dq - plain.dq).max() > 1e-3


def test_recording_holds_what_the_robot_would_log() -> None:
    """The monitor sees a run as it sees a file."""
    run = simulate_impact(90.0, 0.3, 2.0)
    recording = run.recording()
    assert set(recording.channels) == {"q", "dq", "tau"}
    assert recording.labels[0].kind == "impact"
    assert recording.rate_hz == pytest.approx(1000.0)


def test_bad_input() -> None:
    """One line says what is wrong."""
    with pytest.raises(TactfulError, match="out of reach"):
        simulate_impact(90.0, 1.2, 0.0)
    with pytest.raises(TactfulError, match="rows of alpha"):
        simulate_impacts([(90.0, 0.3)])  # type: ignore[list-item]
    with pytest.raises(TactfulError, match="end after it begins"):
        SurfaceConfig(begin_m=0.1, end_m=0.0)
    with pytest.raises(TactfulError, match="jobs"):
        simulate_impacts([(90.0, 0.3, 0.0)], jobs=0)


@pytest.mark.parametrize("friction", [0.0, 0.1])
def test_tends_to_the_impact_map_as_joints_and_contact_stiffen(friction: float) -> None:
    """A flat face on a surface: 1 ms after it, the velocity of an ever stiffer arm is that of the rigid impact map."""
    off = []
    for stiffer in (1.0, 10.0, 100.0):
        arm = ArmConfig(
            stiffness_nm_rad=tuple(stiffer * K for K in (12000.0, 12000.0, 5000.0)),
            damping_nms_rad=tuple(np.sqrt(stiffer) * D for D in (120.0, 100.0, 32.0)),
        )
        contact = CompliantContactConfig(stiffness=2e7 * stiffer, restitution=0.01, friction=friction)
        config = PlanarConfig(
            arm=arm,
            contact=contact,
            task=TaskConfig(friction=friction),
            step_s=1e-4,
            contact_step_s=2e-5,
            duration_s=0.505,
        )
        run = simulate_impact(75.0, 0.3, 0.0, config)
        jump = np.abs(run.dq[498] - run.plan.dq_d(0.5)).max()
        off.append(np.abs(run.dq[501] - run.plan.dq_d(0.501)).max() / jump)
    assert off[0] > 1.5 * off[1] > 2.25 * off[2]
    assert off[2] < 0.015
