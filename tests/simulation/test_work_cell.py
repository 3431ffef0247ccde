"""The work cell: its physics against an independent implementation, and its truth against MuJoCo's own sums."""

import sys
from dataclasses import replace

import mujoco
import numpy as np
import pytest

from tactful.control import CartesianImpedance, Pose
from tactful.dynamics import Dynamics
from tactful.errors import TactfulError
from tactful.estimation import MomentumObserver, external_wrench
from tactful.robots import Robot
from tactful.simulation import Box, CellConfig, Push, SensorConfig, WorkCell

PANDA = Robot.load("panda")
DYNAMICS = Dynamics(PANDA)
HOME = DYNAMICS.pose(PANDA.home)
EXACT = SensorConfig.exact()
WALL = Box(name="wall", centre_m=(0.45, 0.0, 0.62), size_m=(0.1, 0.5, 0.1))


def moving(t: float) -> Pose:
    """Go along x for ever at 0.15 m/s."""
    return Pose(HOME[0], HOME[1] + np.array([0.15 * t, 0.0, 0.0]))


def wall_and_hand(robot: Robot = PANDA, **changes: float) -> WorkCell:
    """An arm that will meet a wall and is pushed at the forearm meanwhile."""
    hand = Push(link=robot.link_names[4], point_m=(0.0, 0.05, -0.1), force_n=(3.0, 12.0, -5.0), start_s=0.1, hold_s=2.0)
    return WorkCell(robot, [WALL], hands=[hand], config=CellConfig(**changes), sensors=EXACT)


def test_samples_obey_the_equation_of_motion() -> None:
    """M ddq + C dq + g = tau + tau_ext at every sample, by our own dynamics: in free motion, impact and push alike."""
    cell = wall_and_hand(substeps=1)
    controller = CartesianImpedance(PANDA)
    worst = 0.0
    for sample in cell.run(controller, moving, 1.2):
        torque = DYNAMICS.inverse_dynamics(sample.q, sample.dq, cell.data.qacc)
        worst = max(worst, np.abs(torque - sample.tau - cell.tau_ext).max())
    assert {contact.kind for contact in cell.contacts} == {"collision", "cooperation"}
    assert worst < 1e-6


def test_motor_side_torque_obeys_it_too() -> None:
    """Where the torque is measured at the motor, the rotor is part of what it moves."""
    arm = replace(PANDA, torque_sensor="motor", motor_inertia=np.full(7, 0.3))
    dynamics = Dynamics(arm)
    cell = wall_and_hand(arm, substeps=1)
    worst = 0.0
    for sample in cell.run(CartesianImpedance(arm), moving, 0.6):
        torque = dynamics.inverse_dynamics(sample.q, sample.dq, cell.data.qacc)
        worst = max(worst, np.abs(torque - sample.tau - cell.tau_ext).max())
    assert worst < 1e-6


def test_contact_torque_is_all_of_mujocos_constraint_torque() -> None:
    """An arm without friction or stops has no other constraint, so the masked sum must equal MuJoCo's whole one."""
    cell = wall_and_hand(substeps=1)
    touched = 0
    for _ in cell.run(CartesianImpedance(PANDA), moving, 1.2):
        contact_torque = cell.tau_ext - cell.data.qfrc_applied
        np.testing.assert_allclose(contact_torque, cell.data.qfrc_constraint, atol=1e-9)
        touched += bool(np.abs(contact_torque).max() > 1)
    assert touched > 100


def test_friction_and_stops_of_the_joints_are_not_external() -> None:
    """Nobody touches an arm that leans on its own stop: its sensor feels the stop, the truth must not."""
    arm = replace(PANDA, upper=np.where(np.arange(7) == 0, 0.01, PANDA.upper), coulomb_friction=np.full(7, 0.5))
    cell = WorkCell(arm, sensors=EXACT)
    for _ in range(300):
        sample = cell.step([8.0, 0, 0, 0, 0, 0, 0])
        assert not cell.tau_ext.any()
    assert sample.q[0] > 0.01
    assert abs(sample.tau[0]) < 0.5
    assert cell.contacts == ()


def test_free_motion_leaves_no_residual() -> None:
    """The momentum observer is the monitor's eye: with exact sensors, free motion must look free."""
    cell = WorkCell(PANDA, sensors=EXACT)
    for _ in cell.run(CartesianImpedance(PANDA), moving, 1.0):
        pass
    recording = cell.recording()
    assert np.abs(recording.dq).max() > 0.2
    residual = MomentumObserver(PANDA).run(recording.t, recording.q, recording.dq, recording.tau)
    assert np.abs(residual).max() < 0.02


def test_known_force_is_estimated() -> None:
    """A hand's steady force on the last link has to come back from joint torques, in size and direction."""
    hand = Push(link="panda_link7", force_n=(4.0, -10.0, 6.0), start_s=0.1, hold_s=2.0)
    cell = WorkCell(PANDA, hands=[hand], sensors=EXACT)
    for _ in cell.run(CartesianImpedance(PANDA), lambda t: Pose(*HOME), 1.5):
        pass
    recording = cell.recording()
    residual = MomentumObserver(PANDA).run(recording.t, recording.q, recording.dq, recording.tau)
    np.testing.assert_allclose(residual[-1], cell.tau_ext, atol=0.02)
    force = external_wrench(DYNAMICS.jacobian(recording.q[-1]), residual[-1]).force_n
    np.testing.assert_allclose(force, hand.force_n, atol=0.1)


def test_truth_begins_with_the_touch() -> None:
    """A label is the measure of every latency: no torque before it, torque from it on, and the right link."""
    cell = WorkCell(PANDA, [WALL], sensors=EXACT)
    t, torque = [], []
    for sample in cell.run(CartesianImpedance(PANDA), moving, 1.2):
        t.append(sample.t)
        torque.append(np.abs(cell.tau_ext).max())
    (contact,) = cell.contacts
    before = np.array(t) < contact.touch_s
    assert before.sum() > 300
    assert not np.array(torque)[before].any()
    assert np.all(np.array(torque)[~before][:20] > 0)
    assert contact.visible_s is not None
    assert contact.touch_s <= contact.visible_s < contact.touch_s + 0.005
    assert (contact.kind, contact.name, PANDA.link_names[contact.link]) == ("collision", "wall", "panda_link7")
    (label,) = cell.recording().labels
    assert label == contact.label()


def test_contact_grows_instead_of_jumping() -> None:
    """A force that jumps at the touch makes detectors look faster than they can be: half the period, half the step."""
    largest = []
    for period in (0.001, 0.0005):
        cell = WorkCell(PANDA, [WALL], config=CellConfig(period_s=period, substeps=1), sensors=EXACT)
        controller = CartesianImpedance(PANDA)
        force = []
        for sample in cell.run(controller, moving, 0.8):
            force.append(np.linalg.norm(np.linalg.pinv(DYNAMICS.jacobian(sample.q).T) @ cell.tau_ext))
        largest.append(np.abs(np.diff(force)).max())
        assert max(force) > 20
        first = np.flatnonzero(np.array(force) > 1e-9)[0]
        assert force[first] < 1.0
    assert largest[0] < 20
    assert largest[1] < 0.65 * largest[0]


def test_seed_decides_everything() -> None:
    """A result that cannot be repeated cannot be examined; another seed has to be another noise."""

    def record(seed: int) -> np.ndarray:
        cell = WorkCell(PANDA, [WALL], rng=np.random.default_rng(seed))
        for _ in cell.run(CartesianImpedance(PANDA), moving, 0.8):
            pass
        recording = cell.recording()
        return np.hstack([recording.q, recording.dq, recording.tau])

    np.testing.assert_array_equal(record(3), record(3))
    assert np.any(record(3) != record(4))


def test_every_built_in_arm_with_joint_torque_sensors_runs() -> None:
    """A cell is for any arm of that kind, and its controller must not shake the light ones."""
    for name in Robot.names():
        arm = Robot.load(name)
        if arm.torque_sensor == "link":
            pose = Pose(*Dynamics(arm).pose(arm.home))
            cell = WorkCell(arm, hands=[Push(link=arm.link_names[-1], force_n=(0, 8, 0), start_s=0.05, hold_s=1.0)])
            *_, last = cell.run(CartesianImpedance(arm), lambda t, pose=pose: pose, 0.6)
            assert np.abs(last.dq).max() < 0.5, name


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (
            {"hands": [Push(link="finger", force_n=(1, 0, 0), start_s=0, hold_s=1)]},
            "touches 'finger', but the links are",
        ),
        ({"q": np.zeros(6)}, "q has shape"),
        ({"fixtures": [WALL, WALL]}, "fixture 'wall' cannot be added: .*repeated name"),
    ],
)
def test_impossible_cell_is_refused(change: dict[str, object], message: str) -> None:
    """A slip in the scene is told in one line where the cell is built."""
    with pytest.raises(TactfulError, match=message):
        WorkCell(PANDA, **change)


def test_impossible_torque_is_refused() -> None:
    """A torque that is no number would poison the whole simulation silently."""
    cell = WorkCell(PANDA)
    for torque in (np.zeros(6), np.full(7, np.nan)):
        with pytest.raises(TactfulError, match="needs 7 finite numbers"):
            cell.step(torque)


def test_missing_mujoco_names_the_extra(monkeypatch: pytest.MonkeyPatch) -> None:
    """Without the extra the user has to learn what to install."""
    monkeypatch.setitem(sys.modules, "mujoco", None)
    with pytest.raises(TactfulError, match=r'pip install "tactful\[mujoco\]"'):
        WorkCell(PANDA)


def test_any_object_can_stand_in_the_cell() -> None:
    """A fixture is an object with a name and `attach`: what the package does not know, a user adds."""

    class Ball:
        name = "ball"

        def attach(self, world: mujoco.MjsBody) -> None:
            body = world.add_body(name=self.name, pos=HOME[1] + np.array([0.0, 0.0, -0.06]))
            body.add_geom(type=mujoco.mjtGeom.mjGEOM_SPHERE, size=[0.05, 0, 0])

    cell = WorkCell(PANDA, [Ball()], sensors=EXACT)
    for _ in cell.run(CartesianImpedance(PANDA), lambda t: Pose(HOME[0], HOME[1] - np.array([0, 0, 0.1])), 0.4):
        pass
    assert [contact.name for contact in cell.contacts] == ["ball"]
