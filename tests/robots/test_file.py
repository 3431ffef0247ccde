"""Arms from MJCF and URDF files, against MuJoCo's own kinematics and dynamics of the same file."""

import sys
from dataclasses import fields

import numpy as np
import pytest

from tactful.robots import Robot, RobotFileError, UnknownFrameError

from ._reference import frame_pose, mass_matrix_and_gravity

mujoco = pytest.importorskip("mujoco")

# Offset and tilted anchors, a ref, a slide, a fixed body with mass, a branch, a mounted base.
ARM = """
<mujoco model="odd">
  <compiler angle="radian"/>
  <option gravity="0 0 -9.8"/>
  <default><geom contype="0" conaffinity="0"/></default>
  <worldbody>
    <geom type="plane" size="1 1 1" contype="1"/>
    <body name="stand" pos="0.2 0.1 0.5" euler="0.3 0 0.4">
      <site name="mount" pos="0 0 0.05"/>
      <body name="upper" pos="0 0 0.1" euler="0 0.2 0">
        <inertial mass="2" pos="0 0.01 0.1" fullinertia="0.02 0.03 0.025 0.001 0 0.002"/>
        <joint name="j1" axis="0 1 2" pos="0.02 -0.03 0.04" range="-2 2" limited="true" armature="0.1"
          damping="0.5" frictionloss="0.2" actuatorfrcrange="-40 40" actuatorfrclimited="true"/>
        <geom type="capsule" fromto="0 0 0 0 0 0.2" size="0.04" contype="1"/>
        <body name="bracket" pos="0 0.02 0.2" euler="0.1 0.2 0.3">
          <inertial mass="0.5" pos="0.01 0 0.02" diaginertia="0.001 0.002 0.0015"/>
          <geom type="box" size="0.02 0.03 0.1" contype="1"/>
          <body name="ram" pos="0.05 0 0" euler="0 0 1">
            <inertial mass="1" pos="0 0 0.05" diaginertia="0.004 0.005 0.003"/>
            <joint name="j2" type="slide" axis="0 0 1" pos="0.1 0.1 0.1" ref="0.07"/>
            <body name="wrist" pos="0 0 0.3">
              <inertial mass="0.7" pos="0.01 0.02 0.03" diaginertia="0.002 0.003 0.0025"/>
              <joint name="j3" axis="1 0 0" pos="0 0.05 0" ref="0.6"/>
              <geom type="cylinder" size="0.03 0.1" pos="0 0 0.1" contype="1"/>
              <site name="attachment_site" pos="0 0 0.1" euler="0 0.5 0"/>
              <body name="left_finger" pos="0 0.02 0.1">
                <inertial mass="0.1" pos="0 0 0.02" diaginertia="1e-4 1e-4 1e-4"/>
                <joint name="f1" type="slide" axis="0 1 0"/>
                <site name="pad"/>
              </body>
              <body name="right_finger" pos="0 -0.02 0.1">
                <inertial mass="0.1" pos="0 0 0.02" diaginertia="1e-4 1e-4 1e-4"/>
                <joint name="f2" type="slide" axis="0 -1 0"/>
              </body>
            </body>
          </body>
        </body>
      </body>
    </body>
    <body name="other_arm" pos="3 0 0">
      <joint name="o1"/>
      <inertial mass="9" pos="0 0 0" diaginertia="1 1 1"/>
    </body>
    <body name="ball" pos="2 0 1"><freejoint/><geom size="0.1" mass="1"/></body>
  </worldbody>
  <actuator>
    <motor joint="j2" gear="3" forcelimited="true" forcerange="-5 5"/>
    <motor joint="j3" gear="2" ctrllimited="true" ctrlrange="-4 4"/>
  </actuator>
  <keyframe><key name="home" qpos="0.3 0.1 0.4 0 0 0 2 0 1 1 0 0 0"/></keyframe>
</mujoco>
"""

URDF = """
<robot name="twin">
  <link name="pedestal"/>
  <link name="shoulder">
    <inertial>
      <origin xyz="0.1 0 0" rpy="0.2 0 0"/><mass value="2"/>
      <inertia ixx="0.02" iyy="0.03" izz="0.025" ixy="0.001" ixz="0" iyz="0"/>
    </inertial>
    <visual><geometry><mesh filename="package://nowhere/shoulder.dae"/></geometry></visual>
    <collision><geometry><mesh filename="package://nowhere/shoulder.stl"/></geometry></collision>
  </link>
  <link name="sensor">
    <inertial><mass value="0.3"/><inertia ixx="1e-3" iyy="1e-3" izz="1e-3" ixy="0" ixz="0" iyz="0"/></inertial>
  </link>
  <link name="slider">
    <inertial><mass value="1"/><inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial>
  </link>
  <link name="flange"/>
  <joint name="turn" type="revolute">
    <origin xyz="0 0 0.4" rpy="0.1 0.2 0.3"/><parent link="pedestal"/><child link="shoulder"/><axis xyz="0 0 1"/>
    <limit lower="-1" upper="2" effort="30" velocity="1.5"/><dynamics damping="0.4" friction="0.7"/>
  </joint>
  <joint name="glue" type="fixed">
    <origin xyz="0.2 0 0" rpy="0 0 1.5"/><parent link="shoulder"/><child link="sensor"/>
  </joint>
  <joint name="push" type="prismatic">
    <origin xyz="0 0.1 0"/><parent link="sensor"/><child link="slider"/><axis xyz="0 1 0"/>
    <limit lower="0" upper="0.3" effort="100" velocity="0"/>
  </joint>
  <joint name="end" type="fixed">
    <origin xyz="0 0 0.05"/><parent link="slider"/><child link="flange"/>
  </joint>
</robot>
"""


@pytest.fixture
def write(tmp_path):
    """Write a text to a file and return its path."""

    def _write(text, name="arm.xml"):
        path = tmp_path / name
        path.write_text(text)
        return path

    return _write


def test_mjcf_keeps_kinematics_and_dynamics(write):
    """Every reading rule at once: MuJoCo's poses, mass matrix and gravity of the file are the oracle."""
    robot = Robot.load(write(ARM))
    assert robot.joint_names == ("j1", "j2", "j3")
    assert robot.prismatic.tolist() == [False, True, False]
    assert robot.tip == "attachment_site"
    model = mujoco.MjModel.from_xml_string(ARM)
    data = mujoco.MjData(model)
    for q in np.random.default_rng(0).uniform(-1, 1, (20, 3)):
        data.qpos[:3] = q
        data.qpos[3:5] = 0
        mujoco.mj_forward(model, data)
        base = np.eye(4)
        base[:3, :3], base[:3, 3] = data.body("stand").xmat.reshape(3, 3), data.body("stand").xpos
        for name in ("attachment_site", "mount"):
            T = base @ frame_pose(robot, q, name)
            np.testing.assert_allclose(T[:3, 3], data.site(name).xpos, atol=1e-12)
            np.testing.assert_allclose(T[:3, :3].ravel(), data.site(name).xmat, atol=1e-12)
        for name in ("upper", "bracket", "ram", "wrist"):
            np.testing.assert_allclose((base @ frame_pose(robot, q, name))[:3, 3], data.body(name).xpos, atol=1e-12)
        M, g = mass_matrix_and_gravity(robot, q)
        rows = np.empty((3, model.nv))
        for k in range(3):
            mujoco.mj_mulM(model, data, rows[k], np.eye(model.nv)[k])
        np.testing.assert_allclose(rows[:, :3], M, atol=1e-12)
        np.testing.assert_allclose(data.qfrc_bias[:3], g, atol=1e-12)


def test_mjcf_keeps_joint_figures(write):
    """Limits, armature, losses and actuator ranges land in their fields; home is the keyframe's."""
    robot = Robot.load(write(ARM))
    np.testing.assert_array_equal(robot.lower, [-2, -np.inf, -np.inf])
    np.testing.assert_array_equal(robot.motor_inertia, [0.1, 0, 0])
    np.testing.assert_array_equal(robot.viscous_friction, [0.5, 0, 0])
    np.testing.assert_array_equal(robot.coulomb_friction, [0.2, 0, 0])
    np.testing.assert_array_equal(robot.torque_limit, [40, 15, 8])
    np.testing.assert_array_equal(robot.home, [0.3, 0.1, 0.4])
    assert np.isnan(robot.stiffness).all()


def test_mjcf_shapes_become_capsules(write):
    """A capsule stays, a box and a cylinder keep their length; what cannot collide and the floor are left out."""
    capsule, box, cylinder = Robot.load(write(ARM)).capsules
    assert (capsule.link, box.link, cylinder.link) == (0, 0, 2)
    assert capsule.radius_m == 0.04
    assert np.linalg.norm(capsule.p1_m - capsule.p0_m) == pytest.approx(0.2)
    assert box.radius_m == pytest.approx(0.025)
    assert np.linalg.norm(box.p1_m - box.p0_m) + 2 * box.radius_m == pytest.approx(0.2)
    assert np.linalg.norm(cylinder.p1_m - cylinder.p0_m) + 2 * cylinder.radius_m == pytest.approx(0.2)


def test_tip_decides_the_chain(write):
    """Any site or link can be named; a finger's pad makes the finger a joint of the arm, a stand makes none."""
    path = write(ARM)
    assert Robot.load(path, tip="bracket").n == 1
    finger = Robot.load(path, tip="pad")
    assert finger.joint_names == ("j1", "j2", "j3", "f1")
    assert finger.mass.sum() == pytest.approx(4.4)
    assert Robot.load(path, tip="other_arm").joint_names == ("o1",)
    with pytest.raises(UnknownFrameError, match="did you mean 'wrist'"):
        Robot.load(path, tip="wirst")
    with pytest.raises(RobotFileError, match="no joint moves 'stand'"):
        Robot.load(path, tip="mount")
    with pytest.raises(RobotFileError, match="a free joint"):
        Robot.load(path, tip="ball")


def test_default_tip_is_the_last_link_before_the_fingers(write):
    """Without a tip site a gripper's finger ends the longest chain; it must not become the arm's last joint."""
    robot = Robot.load(write(ARM.replace("attachment_site", "camera")))
    assert robot.tip == "wrist"
    assert robot.n == 3


@pytest.mark.parametrize("name", Robot.names())
def test_round_trip_of_the_built_in_arms(write, name):
    """What is written is read again: figures to 1e-12, frames, capsules and gravity."""
    robot = Robot.load(name).with_gravity([1.0, 2.0, -9.0])
    twin = Robot.load(write(robot.to_mjcf()), tip=robot.tip)
    for field in fields(Robot):
        value = getattr(robot, field.name)
        if isinstance(value, np.ndarray) and field.name not in ("velocity_limit", "stiffness", "damping", "home"):
            np.testing.assert_allclose(getattr(twin, field.name), value, atol=1e-12, err_msg=field.name)
    for frame in robot.frames:
        assert twin.frames[frame].link == robot.frames[frame].link
        np.testing.assert_allclose(twin.frames[frame].rotation, robot.frames[frame].rotation, atol=1e-12)
        np.testing.assert_allclose(twin.frames[frame].translation, robot.frames[frame].translation, atol=1e-12)
    for ours, theirs in zip(robot.capsules, twin.capsules, strict=True):
        assert (ours.link, ours.radius_m) == (theirs.link, theirs.radius_m)
        ends = np.sort([theirs.p0_m, theirs.p1_m], axis=0), np.sort([ours.p0_m, ours.p1_m], axis=0)
        np.testing.assert_allclose(*ends, atol=1e-12)


def test_round_trip_keeps_losses_and_slides(write):
    """The odd arm has what the built-in ones lack: friction, a slide, a tilted gravity, unlimited joints."""
    robot = Robot.load(write(ARM))
    twin = Robot.load(write(robot.to_mjcf(), "twin.xml"), tip=robot.tip)
    for name in ("rotation", "translation", "axis", "mass", "com", "inertia", "gravity", "lower", "torque_limit"):
        np.testing.assert_allclose(getattr(twin, name), getattr(robot, name), atol=1e-12, err_msg=name)
    for name in ("prismatic", "motor_inertia", "viscous_friction", "coulomb_friction"):
        np.testing.assert_array_equal(getattr(twin, name), getattr(robot, name))


def test_urdf_keeps_fixed_links_as_frames_and_lumps_them(write):
    """Meshes need not exist; a fixed sensor weighs on its link and stays nameable."""
    robot = Robot.load(write(URDF, "arm.urdf"))
    assert robot.name == "twin"
    assert robot.link_names == ("shoulder", "slider")
    assert robot.tip == "flange"
    assert set(robot.frames) == {"pedestal", "shoulder", "sensor", "slider", "flange"}
    assert robot.frames["pedestal"].link == -1
    assert robot.mass.tolist() == pytest.approx([2.3, 1.0])
    np.testing.assert_allclose(robot.com[0], (2 * np.array([0.1, 0, 0]) + 0.3 * np.array([0.2, 0, 0])) / 2.3)
    np.testing.assert_array_equal(robot.lower, [-1, 0])
    np.testing.assert_array_equal(robot.upper, [2, 0.3])
    np.testing.assert_array_equal(robot.velocity_limit, [1.5, np.inf])
    np.testing.assert_array_equal(robot.torque_limit, [30, 100])
    np.testing.assert_array_equal(robot.viscous_friction, [0.4, 0])
    np.testing.assert_array_equal(robot.coulomb_friction, [0.7, 0])


def test_urdf_agrees_with_pinocchio(write):
    """Pinocchio reads URDF by its own parser."""
    pin = pytest.importorskip("pinocchio")
    robot = Robot.load(write(URDF, "arm.urdf"))
    model = pin.buildModelFromXML(URDF)
    data = model.createData()
    for q in np.random.default_rng(0).uniform(-1, 1, (20, 2)):
        M = pin.crba(model, data, q)
        pin.framesForwardKinematics(model, data, q)
        ours = mass_matrix_and_gravity(robot, q)
        np.testing.assert_allclose(ours[0], np.triu(M) + np.triu(M, 1).T, atol=1e-12)
        np.testing.assert_allclose(ours[1], pin.computeGeneralizedGravity(model, data, q), atol=1e-12)
        pose = data.oMf[model.getFrameId("flange")].homogeneous
        np.testing.assert_allclose(frame_pose(robot, q, "flange"), pose, atol=1e-12)


def test_missing_meshes_do_not_matter_where_inertias_are_given(write):
    """Models are often passed on without their meshes."""
    mesh = '<asset><mesh name="m" file="gone.stl"/></asset><worldbody>'
    body = '<geom type="mesh" mesh="m"/>{}<joint/>'
    given = '<inertial mass="1" pos="0 0 0" diaginertia="1 1 1"/>'
    model = "<mujoco>" + mesh + "<body name='a'>{}</body></worldbody></mujoco>"
    assert Robot.load(write(model.format(body.format(given)))).mass.tolist() == [1.0]
    with pytest.raises(RobotFileError, match=r"gone\.stl"):
        Robot.load(write(model.format(body.format(""))))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("<mujoco><worldbody>", "not well-formed XML"),
        ("", "not well-formed XML"),
        ("\x00\x01", "not well-formed XML"),
        ("<html/>", "neither MJCF .* nor URDF .*its root is <html>"),
        ("<mujoco/>", "no chain of hinge and slide joints"),
        ("<mujoco><worldbody><body><freejoint/><geom size='1'/></body></worldbody></mujoco>", "no chain of hinge"),
        ("<mujoco><worldbody><body><joint type='hose'/></body></worldbody></mujoco>", "cannot be compiled"),
        ("<mujoco><worldbody><body><joint/></body></worldbody></mujoco>", "mass and inertia of moving bodies"),
        (
            "<mujoco><worldbody><body name='b'><joint/><joint/><geom size='1'/></body></worldbody></mujoco>",
            "body 'b' has 2 joints",
        ),
        ("<robot name='r'/>", "cannot be compiled|not an arm"),
        ("<robot name='r'><link name='a'/><joint name='j' type='fixed'/></robot>", "cannot be compiled"),
        ("<robot xmlns:xacro='http://ros.org/wiki/xacro'><xacro:macro/></robot>", "expand them first"),
        (URDF.replace("<axis xyz='0 1 0'/>", "").replace('velocity="0"', 'velocity="fast"'), "fast"),
        (URDF.replace('<axis xyz="0 1 0"/>', '<axis xyz="0 1 0"/><mimic joint="turn"/>'), "mimics 'turn'"),
    ],
)
def test_bad_files_get_one_clear_line(write, text, message):
    """Whatever is wrong with a file, the user sees its path and one line."""
    path = write(text)
    with pytest.raises(RobotFileError, match=message) as caught:
        Robot.load(path)
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value)


def test_missing_file_and_directory(tmp_path):
    """A wrong path is a file error, not an unknown built-in robot."""
    with pytest.raises(RobotFileError, match="No such file"):
        Robot.load(tmp_path / "none.urdf")
    (tmp_path / "dir.xml").mkdir()
    with pytest.raises(RobotFileError, match="directory"):
        Robot.load(tmp_path / "dir.xml")


def test_without_mujoco_the_extra_is_named(write, monkeypatch):
    """The core alone cannot read robot files; the line says what to install."""
    monkeypatch.setitem(sys.modules, "mujoco", None)
    with pytest.raises(RobotFileError, match=r"pip install \"tactful\[mujoco\]\""):
        Robot.load(write(ARM))
