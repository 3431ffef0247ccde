"""The built-in arms against what their manufacturers publish and against MuJoCo and Pinocchio."""

import subprocess
import sys

import numpy as np
import pytest

from tactful.robots import Robot

from ._reference import craig, dh, frame_pose, mass_matrix_and_gravity

ARMS = ("fr3", "gen3", "iiwa14", "panda", "ur10e", "ur5e")
H = np.pi / 2
# Craig's a, alpha, d: https://frankarobotics.github.io/docs/robot_specifications.html
FRANKA = ((0, 0, 0.333), (0, -H, 0), (0, H, 0.316), (0.0825, H, 0), (-0.0825, -H, 0.384), (0, H, 0), (0.088, H, 0))
# Standard DH a, alpha, d: Universal Robots, "DH parameters for calculations of kinematics and dynamics"
UR5E = ((0, H, 0.1625), (-0.425, 0, 0), (-0.3922, 0, 0), (0, H, 0.1333), (0, -H, 0.0997), (0, 0, 0.0996))
UR10E = ((0, H, 0.1807), (-0.6127, 0, 0), (-0.57155, 0, 0), (0, H, 0.17415), (0, -H, 0.11985), (0, 0, 0.11655))
# Standard DH of the LBR iiwa 14 R820: joint distances 360, 420, 400 and 126 mm
IIWA = ((0, -H, 0.36), (0, H, 0), (0, H, 0.42), (0, -H, 0), (0, -H, 0.4), (0, H, 0), (0, 0, 0.126))


def _configurations(robot, count=20, seed=0):
    lower, upper = np.maximum(robot.lower, -np.pi), np.minimum(robot.upper, np.pi)
    return np.random.default_rng(seed).uniform(lower, upper, (count, robot.n))


def test_names_are_the_data_files():
    """A data file that is not packaged, or a stray one, would change this list."""
    assert Robot.names() == ARMS


@pytest.mark.parametrize("name", ARMS)
def test_figures_are_complete_and_plausible(name):
    """Every arm has what the monitor needs: limits to scale by, frames, a surface on each link, a stated source."""
    robot = Robot.load(name)
    assert robot.name == name
    assert "flange" in robot.frames
    assert 5 < robot.mass.sum() < 35
    assert np.isfinite(robot.velocity_limit).all()
    assert np.isfinite(robot.torque_limit).all()
    assert {c.link for c in robot.capsules} == set(range(-1, robot.n))
    assert all(0.01 < c.radius_m < 0.16 for c in robot.capsules)
    assert any(licence in robot.source for licence in ("Apache-2.0", "BSD-3-Clause", "MIT"))
    assert robot.torque_sensor == ("motor" if name.startswith("ur") else "link")


@pytest.mark.parametrize("name", ["panda", "fr3"])
def test_franka_flange_follows_the_published_dh_table(name):
    """The manufacturer's own table, typed by hand, is independent of the data file."""
    robot = Robot.load(name)
    for q in _configurations(robot):
        T = np.eye(4)
        for (a, alpha, d), theta in zip(FRANKA, q, strict=True):
            T = T @ craig(a, alpha, d, theta)
        T = T @ craig(0, 0, 0.107, 0)
        np.testing.assert_allclose(frame_pose(robot, q, "flange"), T, atol=1e-12)
        hand = T @ craig(0, 0, 0.1034, -np.pi / 4)  # the Franka Hand's tool centre point
        np.testing.assert_allclose(frame_pose(robot, q, "hand_tcp"), hand, atol=1e-12)


@pytest.mark.parametrize(("name", "table"), [("ur5e", UR5E), ("ur10e", UR10E), ("iiwa14", IIWA)])
def test_flange_follows_the_published_dh_table(name, table):
    """As above for the arms whose tables use the standard convention."""
    robot = Robot.load(name)
    for q in _configurations(robot):
        T = np.eye(4)
        for (a, alpha, d), theta in zip(table, q, strict=True):
            T = T @ dh(a, alpha, d, theta)
        np.testing.assert_allclose(frame_pose(robot, q, robot.tip), T, atol=1e-12)


def test_gen3_stands_as_tall_as_its_user_guide_says():
    """Stretched upwards, Kinova's DH table has the interface 1187.3 mm up and 24.6 mm off axis.

    The table rounds each row to 0.1 mm and neglects a step of 0.2 mm at joint 6.
    """
    T = frame_pose(Robot.load("gen3"), np.zeros(7), "flange")
    np.testing.assert_allclose(np.abs(T[:3, 3]), [0, 0.0246, 1.1873], atol=3e-4)
    np.testing.assert_allclose(T[:3, 2], [0, 0, 1], atol=1e-12)


@pytest.mark.parametrize("name", ARMS)
def test_mass_matrix_and_gravity_agree_with_mujoco(name):
    """MuJoCo, fed with the arm's MJCF, gives the textbook sums over the data file's figures."""
    mujoco = pytest.importorskip("mujoco")
    robot = Robot.load(name)
    model = mujoco.MjModel.from_xml_string(robot.to_mjcf())
    data = mujoco.MjData(model)
    for q in _configurations(robot):
        data.qpos[:] = q
        mujoco.mj_forward(model, data)
        M, g = mass_matrix_and_gravity(robot, q)
        rows = np.empty((robot.n, robot.n))
        for k, unit in enumerate(np.eye(robot.n)):
            mujoco.mj_mulM(model, data, rows[k], unit)
        np.testing.assert_allclose(rows, M, atol=1e-10)
        np.testing.assert_allclose(data.qfrc_bias, g, atol=1e-10)
        for frame in robot.frames:
            np.testing.assert_allclose(data.site(frame).xpos, frame_pose(robot, q, frame)[:3, 3], atol=1e-12)


@pytest.mark.parametrize("name", ARMS)
def test_capsules_do_not_touch_each_other_in_simulation(name):
    """Capsules of neighbouring links overlap; contacts between them would push the simulated arm about."""
    mujoco = pytest.importorskip("mujoco")
    model = mujoco.MjModel.from_xml_string(Robot.load(name).to_mjcf())
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    assert data.ncon == 0


def test_capsules_meet_the_world_in_simulation():
    """An obstacle with MuJoCo's default contact bits, put into the arm, is in contact with it."""
    mujoco = pytest.importorskip("mujoco")
    spec = mujoco.MjSpec.from_string(Robot.load("panda").to_mjcf())
    spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_SPHERE, size=[0.05, 0, 0], pos=[0, 0, 0.333])
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    assert data.ncon > 0


def test_loading_imports_neither_mujoco_nor_rich():
    """The data files have to load on a machine with the core alone, and fast."""
    code = (
        "import sys; from tactful.robots import Robot; Robot.load('panda').to_mjcf();"
        "assert not {'mujoco', 'rich', 'pinocchio'} & set(sys.modules)"
    )
    subprocess.run([sys.executable, "-c", code], check=True)
