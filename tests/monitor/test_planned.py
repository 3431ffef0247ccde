"""The monitor around a planned impact: one that went as planned, others that did not, and what is none."""

import copy
from functools import cache

import numpy as np
import pytest

from tactful.classification import AimAwareConfig, Evidence, ImpactCause, ImpactCauses, ImpactFeatures
from tactful.detection import ImpactConfig
from tactful.errors import TactfulError
from tactful.estimation import MomentumObserver, ObserverConfig
from tactful.impacts import ImpactPlan
from tactful.monitor import ContactEvent, Monitor, MonitorConfig, SampleError
from tactful.recordings import Recording
from tactful.simulation.planar import ArmConfig, PlanarConfig, PlanarImpact, TaskConfig, planar_robot, simulate_impact

ROBOT = planar_robot()
CONFIG = MonitorConfig(
    observer=ObserverConfig(joint_flexibility=True),
    aim_aware=AimAwareConfig.table1(
        "medium", impact=ImpactConfig(r_b_nm_s=(4000.0, 4000.0, np.inf), refractory_s=0.0), bandwidth_hz=50 / 2 / np.pi
    ),
)


@cache
def impact(beta_deg: float = 0.0) -> PlanarImpact:
    """A simulated impact on a surface that is inclined by beta against the plan."""
    return simulate_impact(90.0, 0.3, beta_deg, PlanarConfig(duration_s=0.85))


def events_of(recording: Recording, plan: ImpactPlan | None) -> list[ContactEvent]:
    """All events in the order in which a loop sees them."""
    monitor = Monitor(ROBOT, CONFIG, plan=plan)
    rows = zip(recording.t, recording.q, recording.dq, recording.tau, strict=True)  # type: ignore[arg-type]
    return [event for row in rows if (event := monitor.update(*row)) is not None]


def planned(recording: Recording, plan: ImpactPlan | None) -> list[ContactEvent]:
    """What the timeline says of impacts."""
    return [event for event in Monitor(ROBOT, CONFIG, plan=plan).run(recording) if event.kind.endswith("impact")]


def test_an_impact_that_goes_as_planned() -> None:
    """It is told as expected at the impact already, as a first guess, and stays so."""
    run = impact()
    (event,) = planned(run.recording(), run.plan)
    assert (event.kind, event.reason) == ("expected_impact", None)
    assert event.onset_s == pytest.approx(run.touches[0].time_s, abs=0.01)
    assert event.peak_force_n > 10
    assert event.confidence > 0.5
    told = [event for event in events_of(run.recording(), run.plan) if event.kind == "expected_impact"]
    assert told[0].detected_s - run.touches[0].time_s < 0.01


def test_an_impact_on_an_inclined_surface() -> None:
    """The verdict comes within 0.15 s with the reason, on the event that was a first guess before."""
    run = impact(8.0)
    (event,) = planned(run.recording(), run.plan)
    assert event.kind == "unexpected_impact"
    assert event.reason is not None
    assert event.evidence[0].text.startswith("unexpected: ")


def test_says_how_the_surface_is_inclined() -> None:
    """From the tool, which lies flat on it by then: with its sign, to a fraction of a degree."""
    for beta_deg in (3.0, -5.0):
        run = impact(beta_deg)
        (event,) = planned(run.recording(), run.plan)
        (tilt,) = [item for item in event.evidence if item.rule == "inclination"]
        assert tilt.value == pytest.approx(beta_deg, abs=0.5)


@pytest.mark.parametrize(("offset_m", "kind"), [(0.0, "expected_impact"), (0.05, "unexpected_impact")])
def test_a_ball_strikes_with_one_point(offset_m: float, kind: str) -> None:
    """Single-contact impacts go through the same monitor; a ball does not tell how the surface lies."""
    ball = PlanarConfig(arm=ArmConfig(tip="ball"), task=TaskConfig(surface_offset_m=offset_m))
    run = simulate_impact(90.0, 0.3, 0.0, ball)
    (event,) = planned(run.recording(), run.plan)
    assert event.kind == kind
    assert all(item.rule != "inclination" for item in event.evidence)


class Grips(ImpactCauses):
    """A model that knows one answer."""

    def __init__(self, cause: str) -> None:
        self.answer = ImpactCause(cause, 0.9, {cause: 0.9}, np.zeros(3), (Evidence("slide_1", -0.1, None, cause),))

    def tell_features(self, features: ImpactFeatures) -> ImpactCause:
        """Return the answer."""
        return self.answer


@pytest.mark.parametrize(("cause", "reason"), [("grip", "grip"), ("unknown", "motion"), ("as planned", "motion")])
def test_the_reason_is_the_cause_where_one_is_told(cause: str, reason: str) -> None:
    """A model of causes says more than which condition was violated; where it does not know, that is left."""
    run = impact(8.0)
    monitor = Monitor(ROBOT, CONFIG, plan=run.plan, causes=Grips(cause))
    (event,) = [event for event in monitor.run(run.recording()) if event.kind == "unexpected_impact"]
    assert monitor.impact_cause is not None
    assert monitor.impact_cause.cause == cause
    assert event.reason == reason
    assert event.evidence[-1].text == cause
    (probable,) = [item for item in event.evidence if item.rule == "cause"]
    assert (probable.value, probable.text) == (0.9, f"{cause} is the most probable cause, 90 %")


def test_the_verdict_is_that_of_the_classifier() -> None:
    """The fused kernel has to be the observer and the classifier one after the other."""
    from tactful.classification import AimAware

    run = impact(3.0)
    r = MomentumObserver(ROBOT, CONFIG.observer.model_copy(update={"bandwidth_hz": CONFIG.aim_aware.bandwidth_hz})).run(
        run.t[100:], run.q[100:], run.dq[100:], run.tau[100:]
    )
    aim = AimAware(run.plan, CONFIG.aim_aware)
    aim.run(run.t[100:], run.q[100:], run.dq[100:], r)
    monitor = Monitor(ROBOT, CONFIG, plan=run.plan)
    monitor.run(run.recording())
    assert monitor.impact is not None
    assert monitor.impact.verdict == aim.verdict
    assert monitor.impact.impact_s == aim.result.impact_s
    assert monitor.impact.needed_rad_s == pytest.approx(aim.result.needed_rad_s, abs=1e-6)


@pytest.mark.parametrize("beta_deg", [0.0, 8.0])
def test_stream_is_batch(beta_deg: float) -> None:
    """A loop and an analysis afterwards tell the same, also if the loop goes on from a copy."""
    run = impact(beta_deg)
    recording = run.recording()
    batch = Monitor(ROBOT, CONFIG, plan=run.plan)
    timeline = batch.run(recording)
    monitor = Monitor(ROBOT, CONFIG, plan=run.plan)
    latest: dict[int, ContactEvent] = {}
    rows = zip(recording.t, recording.q, recording.dq, recording.tau, strict=True)  # type: ignore[arg-type]
    for k, row in enumerate(rows):
        if k in (480, 520):
            monitor = copy.copy(monitor)
        event = monitor.update(*row)
        if event is not None:
            latest[event.id] = event
    told = {event.id: event for event in timeline if event.end_s is not None}
    assert {number: event for number, event in latest.items() if event.end_s is not None} == told
    assert [e.kind for e in latest.values()] == [e.kind for e in timeline]


def test_missed() -> None:
    """The surface is not there: the arm goes on, and the plan says so when it is too late."""
    run = impact()
    plan = ImpactPlan(0.25, run.plan.q_d, run.plan.post_t_s, run.plan.post_dq, window_s=(0.1, 0.2))
    (event,) = planned(run.recording(), plan)
    assert (event.kind, event.reason, event.phase) == ("unexpected_impact", "missed", "ended")
    assert event.onset_s == 0.25
    assert event.peak_force_n == 0
    assert event.evidence[0].text == "missed: no impact came"


def test_before_the_window_it_is_a_contact_as_always() -> None:
    """What is struck before the planned impact is a collision, or what the other classifier says."""
    run = impact()
    plan = ImpactPlan(0.8, run.plan.q_d, run.plan.post_t_s, run.plan.post_dq, window_s=(0.05, 0.1))
    without = Monitor(ROBOT, CONFIG).run(run.recording())
    with_plan = Monitor(ROBOT, CONFIG, plan=plan).run(run.recording())
    assert len(without) > 0
    assert [event.kind for event in with_plan][: len(without)] == [event.kind for event in without]


def test_without_a_plan_nothing_is_an_impact() -> None:
    """The same blow is a contact when nobody intended it."""
    assert planned(impact().recording(), None) == []


def test_plans_follow_each_other() -> None:
    """A planner hands over one impact after the other."""
    run = impact()
    monitor = Monitor(ROBOT, CONFIG)
    monitor.expect(run.plan)
    monitor.run(run.recording())
    assert monitor.impact is not None
    monitor.expect(None)
    assert monitor.impact is None


def test_from_the_robots_own_estimate() -> None:
    """An arm that gives no torque but its external torque can be watched too."""
    run = impact()
    recording = run.recording().with_channels(tau=None, tau_ext=run.tau_ext)
    assert [event.kind for event in planned(recording, run.plan)] == ["expected_impact"]


def test_bad_input() -> None:
    """A plan that cannot be watched is refused in one line."""
    run = impact()
    six = ImpactPlan(0.5, [0.0] * 6, [0.5], [[0.0] * 6])
    with pytest.raises(SampleError, match="for 6 joints"):
        Monitor(ROBOT, CONFIG, plan=six)
    with pytest.raises(SampleError, match="no robot"):
        Monitor(config=MonitorConfig(), plan=six)
    still = run.recording().with_channels(dq=None, tau=None, tau_ext=run.tau_ext)
    with pytest.raises(TactfulError, match="needs q, dq"):
        Monitor(ROBOT, CONFIG, plan=run.plan).run(still)
