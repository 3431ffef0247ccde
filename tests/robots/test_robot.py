"""The class itself: what it refuses, what its verbs keep."""

import copy
import pickle
from dataclasses import FrozenInstanceError, fields, replace

import numpy as np
import pytest

from tactful.errors import TactfulError
from tactful.robots import Capsule, Frame, Robot, RobotError, UnknownFrameError, UnknownRobotError

from ._reference import mass_matrix_and_gravity

PANDA = Robot.load("panda")


def test_arrays_are_read_only():
    """Robots are shared between monitors; a change through one of them would spread."""
    arrays = [getattr(PANDA, f.name) for f in fields(PANDA) if isinstance(getattr(PANDA, f.name), np.ndarray)]
    assert len(arrays) == 18
    assert not any(a.flags.writeable for a in arrays)
    with pytest.raises(FrozenInstanceError):
        PANDA.tip = "hand_tcp"
    with pytest.raises(TypeError):
        PANDA.frames["new"] = PANDA.frames["flange"]


def test_the_caller_keeps_its_own_array():
    """Freezing must copy: the array that was handed over stays writeable and apart."""
    mass = PANDA.mass + 1.0
    heavier = replace(PANDA, mass=mass)
    mass[0] = -1.0
    assert heavier.mass[0] == PANDA.mass[0] + 1.0


@pytest.mark.parametrize("copied", [copy.deepcopy, copy.copy, lambda r: pickle.loads(pickle.dumps(r))])
def test_copies_are_equal_and_frozen(copied):
    """A pickled monitor carries its robot; numpy alone would bring the arrays back writeable."""
    twin = copied(PANDA)
    np.testing.assert_array_equal(twin.inertia, PANDA.inertia)
    assert list(twin.frames) == list(PANDA.frames)
    assert not twin.inertia.flags.writeable
    assert not twin.frames["flange"].rotation.flags.writeable
    assert twin.capsules[0].radius_m == PANDA.capsules[0].radius_m


def test_repr_fits_a_line():
    """It stands in error messages and notebooks."""
    assert repr(PANDA) == "Robot('panda', 7 joints, 16.1 kg, tip='flange')"


@pytest.mark.parametrize(
    ("field", "value", "message"),
    [
        ("mass", np.ones(6), r"must have the shape \(7,\), not \(6,\)"),
        ("mass", np.zeros(7), "of link 'panda_link1' must be positive"),
        ("mass", ["heavy"] * 7, "must be numbers"),
        ("com", np.full((7, 3), np.nan), "must be finite"),
        ("axis", np.full((7, 3), 0.5), "must be unit vectors"),
        ("rotation", -PANDA.rotation, "right-handed"),
        ("inertia", -PANDA.inertia, "must be positive definite"),
        ("inertia", np.tile(np.diag([1.0, 1.0, 3.0]), (7, 1, 1)), "triangle inequality"),
        ("inertia", np.tile(np.triu(np.ones((3, 3))), (7, 1, 1)), "not symmetric"),
        ("lower", PANDA.upper + 1, "limit of 'panda_joint1' is above the upper one"),
        ("home", np.full(7, 9.0), "outside the joint limits"),
        ("torque_limit", -PANDA.torque_limit, "must not be negative"),
        ("stiffness", np.full(7, -1.0), "must not be negative"),
        ("torque_sensor", "wrist", "must be 'link' or 'motor'"),
        ("link_names", ("a",) * 7, "must differ"),
        ("link_names", ("a",), "must be 7 names"),
        ("frames", {"flange": Frame(7, np.eye(3), np.zeros(3))}, "lie on link 7"),
        ("capsules", (Capsule(-2, np.zeros(3), np.ones(3), 0.1),), "lie on link -2"),
        ("gravity", np.zeros(2), "must have the shape"),
    ],
)
def test_figures_that_cannot_be_are_refused(field, value, message):
    """A wrong figure found when the robot is built costs a line, found in a residual it costs a day."""
    with pytest.raises(RobotError, match=message) as caught:
        replace(PANDA, **{field: value})
    assert caught.value.field == field
    assert "\n" not in str(caught.value)


def test_unknown_stiffness_and_missing_limits_are_allowed():
    """Unknown is written as nan or inf."""
    robot = replace(PANDA, stiffness=np.full(7, np.nan), upper=np.full(7, np.inf), torque_limit=np.full(7, np.inf))
    assert np.isnan(robot.stiffness).all()


def test_bad_frames_and_capsules_are_refused():
    """Both are built by hand in scripts."""
    with pytest.raises(RobotError, match="not a rotation"):
        Frame(0, 2 * np.eye(3), np.zeros(3))
    with pytest.raises(RobotError, match="finite numbers"):
        Frame(0, np.eye(3), np.zeros(2))
    with pytest.raises(RobotError, match="must be positive"):
        Capsule(0, np.zeros(3), np.ones(3), 0.0)


def test_unknown_names_suggest_the_nearest():
    """A typo is the commonest mistake of all."""
    with pytest.raises(UnknownRobotError, match=r"did you mean 'panda'.*built in: fr3, gen3") as caught:
        Robot.load("pnada")
    assert caught.value.known == Robot.names()
    with pytest.raises(UnknownFrameError, match=r"did you mean 'hand_tcp'.*it has: flange, hand_tcp"):
        Robot.load("panda", tip="hand-tcp")
    assert issubclass(UnknownRobotError, TactfulError)


def test_tip_changes_the_frame_only():
    """Dynamics do not depend on where forces are reported."""
    other = PANDA.with_tip("hand_tcp")
    assert other.tip == "hand_tcp"
    for f in fields(PANDA):
        if f.name != "tip":
            np.testing.assert_array_equal(getattr(other, f.name), getattr(PANDA, f.name))


def test_payload_adds_mass_and_moves_the_centre():
    """Checked by the definition of the centre of mass, in the link's frame."""
    loaded = PANDA.with_payload(0.73, [-0.01, 0.0, 0.03], np.diag([0.001, 0.0025, 0.0017]), frame="hand_tcp")
    frame = PANDA.frames["hand_tcp"]
    com = frame.rotation @ [-0.01, 0.0, 0.03] + frame.translation
    assert loaded.mass[6] == pytest.approx(PANDA.mass[6] + 0.73)
    np.testing.assert_allclose(loaded.mass[6] * loaded.com[6], PANDA.mass[6] * PANDA.com[6] + 0.73 * com, atol=1e-15)
    np.testing.assert_array_equal(loaded.inertia[:6], PANDA.inertia[:6])


def test_payload_adds_its_kinetic_energy():
    """M of the loaded arm is M of the arm plus that of the payload alone, whatever the frame: energies add up."""
    inertia = np.array([[0.02, 0.001, 0.0], [0.001, 0.03, 0.002], [0.0, 0.002, 0.025]])
    loaded = PANDA.with_payload(2.0, [0.05, -0.02, 0.1], inertia)
    tiny = 1e-9
    only = replace(
        PANDA, mass=np.full(7, tiny), inertia=np.tile(tiny * np.eye(3), (7, 1, 1)), motor_inertia=np.zeros(7)
    ).with_payload(2.0, [0.05, -0.02, 0.1], inertia)
    M, g = mass_matrix_and_gravity(loaded, PANDA.home)
    M_arm, g_arm = mass_matrix_and_gravity(PANDA, PANDA.home)
    M_load, g_load = mass_matrix_and_gravity(only, PANDA.home)
    np.testing.assert_allclose(M, M_arm + M_load, atol=1e-7)
    np.testing.assert_allclose(g, g_arm + g_load, atol=1e-7)


def test_two_halves_of_a_payload_weigh_as_the_whole():
    """Lumping is associative; a point mass needs no inertia."""
    whole = PANDA.with_payload(1.0, [0, 0, 0.1])
    halves = PANDA.with_payload(0.5, [0, 0, 0.1]).with_payload(0.5, [0, 0, 0.1])
    np.testing.assert_allclose(whole.inertia, halves.inertia, atol=1e-15)
    np.testing.assert_allclose(whole.com, halves.com, atol=1e-15)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((-1.0, [0, 0, 0]), "positive mass"),
        ((float("nan"), [0, 0, 0]), "positive mass"),
        ((1.0, [0, 0]), "3 finite numbers"),
        ((1.0, [0, 0, 0], np.eye(2)), r"shape \(3, 3\)"),
        ((1.0, [0, 0, 0], np.diag([1.0, 1.0, 5.0])), "triangle inequality"),
    ],
)
def test_bad_payloads_are_refused(arguments, message):
    """These figures come from a user's data sheet."""
    with pytest.raises(RobotError, match=message):
        PANDA.with_payload(*arguments)


def test_payload_frames_are_checked():
    """A load on the base would silently do nothing."""
    with pytest.raises(UnknownFrameError):
        PANDA.with_payload(1.0, [0, 0, 0], frame="elbow")
    base = replace(PANDA, frames={**PANDA.frames, "base": Frame(-1, np.eye(3), np.zeros(3))})
    with pytest.raises(RobotError, match="fixed to the base"):
        base.with_payload(1.0, [0, 0, 0], frame="base")


def test_gravity_turns_with_the_mounting():
    """Hung from the ceiling, all gravity torques change sign."""
    _, g = mass_matrix_and_gravity(PANDA, PANDA.home)
    _, hanging = mass_matrix_and_gravity(PANDA.with_gravity([0, 0, 9.81]), PANDA.home)
    np.testing.assert_allclose(hanging, -g)
    with pytest.raises(RobotError, match="gravity"):
        PANDA.with_gravity([0, 0, np.nan])
