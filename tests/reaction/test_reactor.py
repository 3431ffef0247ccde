"""The reactor: what each reaction does to the arm, its limits, and how the motion goes on."""

from collections.abc import Iterator

import numpy as np
import pytest

from tactful import Robot
from tactful.control import Pose
from tactful.dynamics import Dynamics
from tactful.reaction import NAMED, Plan, ReactionConfig, Reactor, Rule, TaughtPath
from tactful.simulation import Box, Push, SensorConfig, WorkCell
from tests.reaction._events import told

PANDA = Robot.load("panda")
DYNAMICS = Dynamics(PANDA)
HOME = Pose(*DYNAMICS.pose(PANDA.home))
AT_REST = np.zeros(7)


def along_x(t: float) -> Pose:
    """Go along x for ever at 0.15 m/s."""
    return Pose(HOME.rotation, HOME.position_m + np.array([0.15 * t, 0.0, 0.0]))


def drive(cell: WorkCell, reactor: Reactor, seconds: float) -> Iterator[tuple[float, Pose]]:
    """Command the cell, one period after what it measured, and yield where the tip is."""
    tau = reactor.torque(cell.t, cell.q, cell.dq)
    for _ in range(round(1000 * seconds)):
        sample = cell.step(tau)
        tau = reactor.torque(sample.t, sample.q, sample.dq)
        yield sample.t, Pose(*DYNAMICS.pose(sample.q))


def test_without_contact_the_plan_is_followed() -> None:
    """A reactor that nothing happens to is the impedance controller, and nothing else."""
    cell = WorkCell(PANDA, sensors=SensorConfig.exact())
    *_, (t, tip) = drive(cell, Reactor(PANDA, along_x), 1.0)
    lag = along_x(t).position_m - tip.position_m
    np.testing.assert_allclose(lag, [0.15 * 2 * np.sqrt(150) / 150, 0.0, 0.0], atol=0.01)  # B / K times the velocity


def test_stop_holds_where_the_contact_was_detected() -> None:
    """The reference goes on without the arm, which stays: a stop that drifts is none."""
    cell = WorkCell(PANDA, sensors=SensorConfig.exact())
    reactor = Reactor(PANDA, along_x, NAMED["stop"])
    *_, (t, tip) = drive(cell, reactor, 0.8)
    reactor.react(told(), t, cell.q)
    *_, (_, end) = drive(cell, reactor, 1.5)
    assert reactor.reaction == "stop"
    assert np.linalg.norm(end.position_m - tip.position_m) < 0.01
    assert np.abs(cell.dq).max() < 0.01


def test_end_brings_the_arm_to_rest_without_a_jerk() -> None:
    """A run that ends in motion must not feel like a contact: the torque changes little from sample to sample."""
    cell = WorkCell(PANDA, sensors=SensorConfig.exact())
    reactor = Reactor(PANDA, along_x)
    for _ in drive(cell, reactor, 0.8):
        pass
    reactor.finish(cell.q)
    torques, tau = [], reactor.torque(cell.t, cell.q, cell.dq)
    for _ in range(2000):
        sample = cell.step(tau)
        tau = reactor.torque(sample.t, sample.q, sample.dq)
        torques.append(tau)
    assert reactor.reaction == "stop"
    assert np.abs(cell.dq).max() < 0.01
    assert np.abs(np.diff(torques, axis=0)).max() < 0.1


def test_retract_goes_back_along_the_force() -> None:
    """What pushes the arm says where there is room: along its force, as far as was set."""
    cell = WorkCell(PANDA, sensors=SensorConfig.exact())
    reactor = Reactor(PANDA, lambda t: HOME, NAMED["retract"])
    reactor.react(told(force_n=(0.0, 12.0, 16.0)), 0.0, cell.q)
    *_, (_, end) = drive(cell, reactor, 1.5)
    np.testing.assert_allclose(end.position_m - HOME.position_m, [0.0, 0.036, 0.048], atol=0.004)


@pytest.mark.parametrize("changes", [{"damped": True}, {"force_n": (0.0, 0.0, 0.0)}])
def test_retreat_without_a_direction_is_a_stop(changes: dict[str, object]) -> None:
    """Near a singularity the force is not known along one direction: no motion may follow from it."""
    reactor = Reactor(PANDA, lambda t: HOME, NAMED["retract"])
    reactor.react(told(**changes), 0.0, PANDA.home)
    assert reactor.reaction == "stop"


def test_retract_frees_a_wall() -> None:
    """The whole chain in the cell: the contact must end soon, where without a reaction it lasts."""
    wall = Box(name="wall", centre_m=(0.45, 0.0, 0.62), size_m=(0.1, 0.5, 0.1))

    def contact_s(policy: str) -> float:
        cell = WorkCell(PANDA, [wall], sensors=SensorConfig.exact())
        reactor = Reactor(PANDA, along_x, NAMED[policy])
        reacted = False
        for t, _ in drive(cell, reactor, 1.5):
            if not reacted and np.abs(cell.tau_ext).max() > 2.0:
                reacted = True
                force = np.linalg.pinv(DYNAMICS.jacobian(cell.q).T) @ cell.tau_ext
                reactor.react(told(force_n=tuple(force[:3])), t, cell.q)
        return sum(contact.end_s - contact.touch_s for contact in cell.contacts)

    assert contact_s("continue") > 0.5
    assert contact_s("retract") < 0.15


def test_comply_has_no_stiffness_but_its_damping() -> None:
    """A tip that stands still gets no torque, wherever the plan is; one that moves is damped."""
    reactor = Reactor(PANDA, lambda t: Pose(HOME.rotation, HOME.position_m + 0.1), NAMED["comply"])
    reactor.react(told("cooperation"), 0.0, PANDA.home)
    np.testing.assert_allclose(reactor.torque(0.0, PANDA.home, AT_REST), 0.0, atol=1e-9)
    dq = np.linalg.pinv(DYNAMICS.jacobian(PANDA.home)) @ np.array([0.1, 0, 0, 0, 0, 0])
    for k in range(200):  # the rate limit lets it grow
        tau = reactor.torque(0.001 * k, PANDA.home, dq)
    assert tau @ dq == pytest.approx(-2 * np.sqrt(150) * 0.1**2, rel=0.05)


def test_teaching_keeps_the_way_and_merges_it() -> None:
    """A hand leads the tip aside; the path is handed over, and the arm goes on with the plan that comes of it."""
    hand = Push(link="panda_link7", force_n=(0.0, 12.0, 0.0), start_s=0.1, hold_s=0.5)
    cell = WorkCell(PANDA, hands=[hand], sensors=SensorConfig.exact())
    merged: list[TaughtPath] = []

    def merge(taught: TaughtPath, plan: Plan) -> Plan:
        merged.append(taught)
        return lambda s: taught.poses[-1]

    reactor = Reactor(PANDA, lambda t: HOME, NAMED["teach"], merge=merge)
    list(drive(cell, reactor, 0.2))
    reactor.react(told("cooperation"), cell.t, cell.q)
    list(drive(cell, reactor, 0.8))
    reactor.react(told("cooperation", "ended"), cell.t, cell.q)
    *_, (_, end) = drive(cell, reactor, 3.0)
    (taught,) = merged
    assert reactor.taught == [taught]
    assert reactor.reaction == "continue"
    np.testing.assert_allclose(np.diff(taught.t), 0.01, atol=1e-3)
    assert len(taught.poses) == len(taught.t)
    assert taught.poses[-1].position_m[1] - HOME.position_m[1] > 0.1
    np.testing.assert_allclose(end.position_m, taught.poses[-1].position_m, atol=0.03)


def test_released_arm_goes_back_to_its_plan() -> None:
    """After a hand has let go, the arm returns to where it left its plan, smoothly, and the plan has waited."""
    reactor = Reactor(PANDA, along_x, NAMED["comply"])
    reactor.torque(0.0, PANDA.home, AT_REST)
    reactor.react(told("cooperation"), 0.0, PANDA.home)
    reactor.torque(0.1, PANDA.home, AT_REST)
    reactor.react(told("cooperation", "ended"), 0.1, PANDA.home)
    reactor.torque(0.5, PANDA.home, AT_REST)
    assert reactor.reaction == "comply"
    reactor.torque(0.7, PANDA.home, AT_REST)
    assert reactor.reaction == "continue"
    for k in range(1000):
        tau = reactor.torque(0.701 + 0.001 * k, PANDA.home, AT_REST)
    np.testing.assert_allclose(tau, 0.0, atol=0.3)  # the plan is where it was left, which is here


def test_stopped_arm_waits_to_be_told() -> None:
    """Nobody knows whether the way is free: after a collision the arm moves when it is told to, not before."""
    reactor = Reactor(PANDA, along_x, NAMED["stop"])
    reactor.react(told(), 0.0, PANDA.home)
    reactor.react(told(phase="ended"), 0.1, PANDA.home)
    reactor.torque(10.0, PANDA.home, AT_REST)
    assert reactor.reaction == "stop"
    reactor.resume(10.0, PANDA.home)
    assert reactor.reaction == "continue"


def test_policy_may_set_a_time_to_resume() -> None:
    """A cell without people may go on by itself."""
    reactor = Reactor(PANDA, along_x, NAMED["stop"].model_copy(update={"resume_s": 2.0}))
    reactor.react(told(), 0.0, PANDA.home)
    reactor.react(told(phase="ended"), 1.0, PANDA.home)
    reactor.torque(2.9, PANDA.home, AT_REST)
    assert reactor.reaction == "stop"
    reactor.torque(3.1, PANDA.home, AT_REST)
    assert reactor.reaction == "continue"


@pytest.mark.parametrize("policy", ["retract", "teach"])
def test_another_contact_does_not_free_a_stopped_arm(policy: str) -> None:
    """A hand on an arm that stopped at an obstacle must not send it back into the obstacle when it lets go."""
    reactor = Reactor(PANDA, along_x, NAMED[policy])
    reactor.react(told(), 0.0, PANDA.home)
    reactor.react(told(phase="ended"), 0.1, PANDA.home)
    reactor.react(told("contact", id=1), 0.5, PANDA.home)
    reactor.react(told("cooperation", "changed", id=1), 0.6, PANDA.home)
    reactor.react(told("cooperation", "ended", id=1), 1.0, PANDA.home)
    reactor.torque(5.0, PANDA.home, AT_REST)
    assert reactor.reaction == "stop"


def test_a_kind_that_calls_for_nothing_lets_the_arm_go_on() -> None:
    """The stop before the kind is known is for a moment: an expected impact ends it."""
    reactor = Reactor(PANDA, along_x, NAMED["stop"])
    reactor.react(told("contact"), 0.0, PANDA.home)
    assert reactor.reaction == "stop"
    reactor.react(told("expected_impact", "changed"), 0.02, PANDA.home)
    assert reactor.reaction == "continue"


def test_torque_and_its_rate_are_limited_whatever_happens() -> None:
    """The limits hold from sample to sample, also where reactions and poses jump."""
    rng = np.random.default_rng(0)
    share, rate = 0.3, 500.0
    policy = ReactionConfig(
        rules=tuple(Rule(kind=rule.kind, reaction=rule.reaction) for rule in NAMED["retract"].rules),
        torque_share=share,
        torque_rate_nm_s=rate,
    )
    reactor = Reactor(PANDA, along_x, policy)
    before = reactor.torque(0.0, PANDA.home, AT_REST)
    for k in range(1, 2000):
        t = 0.001 * k
        q = PANDA.home + 0.3 * rng.standard_normal(7)
        if rng.random() < 0.05:
            kind = rng.choice(["collision", "contact", "cooperation", "expected_impact"])
            reactor.react(told(str(kind), str(rng.choice(["began", "changed", "ended"])), id=k // 100), t, q)
        tau = reactor.torque(t, q, rng.standard_normal(7))
        assert (np.abs(tau) <= share * PANDA.torque_limit + 1e-9).all()
        assert np.abs(tau - before).max() <= rate * 0.001 + 1e-9
        before = tau
