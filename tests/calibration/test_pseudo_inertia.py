import numpy as np
import pytest

from tactful.calibration._pseudo_inertia import LinkChart, body_of, parameters_of, robot_parameters, with_parameters
from tactful.robots import Robot
from tactful.robots._inertia import inertia_problem


@pytest.fixture
def chart() -> LinkChart:
    """The chart about a link."""
    return LinkChart(robot_parameters(Robot.load("panda"))[3])


def test_the_origin_is_the_nominal_body(chart: LinkChart) -> None:
    """A prior about zero has to be one about the nominal model."""
    parameters, _ = chart(np.zeros(10))
    assert parameters == pytest.approx(chart.nominal, rel=1e-6)


@pytest.mark.parametrize("name", Robot.names())
def test_every_point_is_a_body_that_can_exist(name: str) -> None:
    """Physical consistency has to hold by construction, for any robot and however far the fit goes."""
    rng = np.random.default_rng(3)
    for row in robot_parameters(Robot.load(name)):
        for size in (0.01, 0.3, 2.0):
            mass, _, inertia = body_of(LinkChart(row)(rng.normal(0, size, 10))[0])
            assert mass > 0
            assert inertia_problem(inertia, allow_zero=True) is None


def test_derivative_is_that_of_finite_differences(chart: LinkChart) -> None:
    """A wrong Jacobian does not fail, it only makes the fit slow and its uncertainty wrong."""
    x = np.random.default_rng(0).normal(0, 0.3, 10)
    h = 1e-6
    numeric = np.stack([(chart(x + h * e)[0] - chart(x - h * e)[0]) / (2 * h) for e in np.eye(10)], axis=1)
    assert chart(x)[1] == pytest.approx(numeric, abs=1e-7)


def test_distance_does_not_depend_on_the_frame() -> None:
    """The prior would otherwise say something else of the same link when somebody draws its frame elsewhere."""
    mass, com, inertia = 2.0, np.array([0.1, 0.02, -0.05]), np.diag([0.02, 0.03, 0.025])
    heavier = 2.5, com + 0.01, 1.2 * inertia
    lengths = []
    for offset in (np.zeros(3), np.array([0.3, -0.2, 0.5])):
        nominal, other = (LinkChart(parameters_of(m, c + offset, J)) for m, c, J in ((mass, com, inertia), heavier))
        ratio = np.linalg.solve(nominal._root, other._root)
        lengths.append(np.linalg.norm(np.log(np.linalg.svd(ratio)[1])))
    assert lengths[0] == pytest.approx(lengths[1], rel=1e-6)


def test_parameters_make_the_same_robot_again() -> None:
    """Parameters are about the link's origin, a robot's inertias about the centre of mass."""
    robot = Robot.load("iiwa14")
    again = with_parameters(robot, robot_parameters(robot))
    assert again.inertia == pytest.approx(robot.inertia, abs=1e-12)
    assert again.com == pytest.approx(robot.com, abs=1e-12)
