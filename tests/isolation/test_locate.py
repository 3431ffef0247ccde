"""Where a contact is: the evidence against brute force, and what must hold whatever the arm and the pose."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.stats import multivariate_normal

from tactful import Robot, TactfulError
from tactful.config import ConfigError
from tactful.dynamics import Dynamics
from tactful.isolation import IsolationConfig, IsolationError, Isolator, KnownContact, region_of
from tactful.robots import Capsule, Frame

Array = NDArray[np.float64]

PANDA = Robot.load("panda")
ISOLATOR = Isolator(PANDA)
Q = np.array([0.3, -0.6, 0.2, -2.1, 0.4, 1.8, 0.5])


def touch(robot: Robot, q: Array, link: int, force_n: float, *, cell: int = 7) -> tuple[Array, Array, Array]:
    """Return point, force and torque of a contact, rubbing a little, at one of the surface's cells."""
    cells = Isolator(robot)._grid.cells
    x = cells[cells["link"] == link]["x"][cell]
    dynamics = Dynamics(robot)
    R, o = dynamics._motion["R"][link], dynamics._motion["o"][link]
    dynamics.pose(q)
    tangent = np.cross(x[3:], [0.6, 0.0, 0.8])
    point, force = o + R @ x[:3], force_n * R @ (x[3:] + 0.2 * tangent) / np.linalg.norm(x[3:] + 0.2 * tangent)
    return point, force, dynamics.jacobian_at(q, link, point)[:3].T @ force


@pytest.mark.parametrize("prismatic", [False, True], ids=["revolute", "one prismatic joint"])
def test_evidence_is_the_density_of_a_gaussian(prismatic: bool) -> None:
    """The 3 x 3 algebra has to give the very density that scipy computes from the whole n x n covariance."""
    robot = replace(PANDA, prismatic=[False, True] + [False] * 5) if prismatic else PANDA
    rng = np.random.default_rng(3)
    half = rng.normal(scale=0.2, size=(7, 7))
    Sigma = half @ half.T + 0.05 * np.eye(7)
    tau = rng.normal(scale=2.0, size=7)
    isolator = Isolator(robot, IsolationConfig(friction=0.7, magnitudes_n=(4.0, 12.0, 25.0, 50.0)))
    isolator.locate(Q, tau, Sigma)
    grid, dynamics, checked = isolator._grid, Dynamics(robot), 0
    for cell in grid.cells[np.isfinite(grid.cells["log_p"])][::9]:
        link = grid.links[cell["link"]]
        dynamics.pose(Q)
        R, o = dynamics._motion["R"][cell["link"]].copy(), dynamics._motion["o"][cell["link"]].copy()
        J = dynamics.jacobian_at(Q, cell["link"], o + R @ cell["x"][:3])  # (6, 7)
        u = R @ cell["x"][3:]
        for j, m in enumerate((4.0, 12.0, 25.0, 50.0)):
            tangential = (0.7 * m / 2) ** 2 + (m * link["turn"][0]) ** 2
            S = (m / 2) ** 2 * np.outer(u, u) + tangential * (np.eye(3) - np.outer(u, u))
            covariance = J[:3].T @ S @ J[:3] + (m * link["spread"][0]) ** 2 * J[3:].T @ J[3:] + Sigma
            expected = multivariate_normal(m * J[:3].T @ u, covariance).logpdf(tau)
            assert cell["parts"][j] == pytest.approx(expected, abs=1e-8)
            checked += 1
    assert checked > 20


def test_refining_a_few_cells_is_enough() -> None:
    """Only the best cells are refined, for speed; all of them would have to give the same links."""
    fine = Isolator(PANDA, IsolationConfig(refined_cells=1000))
    for link in range(7):
        _, _, tau = touch(PANDA, Q, link, 12.0)
        expected = fine.locate(Q, tau).link_probabilities
        np.testing.assert_allclose(ISOLATOR.locate(Q, tau).link_probabilities, expected, atol=0.05)


@pytest.mark.parametrize("name", Robot.names())
def test_distal_contact_without_noise_is_found_exactly(name: str) -> None:
    """Six torques and more determine force and point: without noise nothing but the grid is left of the error."""
    robot = Robot.load(name)
    link = robot.n - 1
    q = np.clip(Q[: robot.n], robot.lower + 0.1, robot.upper - 0.1)
    isolator = Isolator(robot)
    isolator.locate(q, np.zeros(robot.n))
    cells = isolator._grid.cells[isolator._grid.cells["link"] == link]
    index = int(np.flatnonzero(np.isfinite(cells["log_p"]))[-1])  # not covered by a neighbour
    point, force, tau = touch(robot, q, link, 20.0, cell=index)
    found = isolator.locate(q, tau, 0.01**2 * np.eye(robot.n))
    assert found.link == robot.link_names[link]
    assert found.region == "distal"
    assert found.confidence > 0.9
    assert not found.ambiguous
    assert np.linalg.norm(found.candidates_m[0] - point) < 0.012
    assert np.linalg.norm(found.force_n - force) < 1.0
    assert found.magnitude_interval_n[0] < 20.0 < found.magnitude_interval_n[1]
    assert not found.several
    if found.point_m is not None:
        assert np.linalg.norm(found.point_m - point) < 0.03


@pytest.mark.parametrize("link", range(7))
def test_posterior_is_a_probability(link: int) -> None:
    """Links, regions and candidates are parts of one posterior, so their probabilities have to add up."""
    _, _, tau = touch(PANDA, Q, link, 15.0, cell=2)
    found = ISOLATOR.locate(Q, tau)
    assert found.link_probabilities.shape == (7,)
    assert found.link_probabilities.sum() == pytest.approx(1.0, abs=1e-12)
    assert found.confidence == found.link_probabilities.max()
    assert 0.9 <= found.candidates_p.sum() <= 1 + 1e-12
    inside = [p for i, p in enumerate(found.link_probabilities) if region_of(i) == found.region]
    assert found.region_confidence == pytest.approx(sum(inside))
    assert np.linalg.eigvalsh(found.force_covariance)[0] >= -1e-9
    assert found.ambiguous == (found.confidence < 0.9)


def test_proximal_contact_names_no_point() -> None:
    """One torque cannot tell where on the first link the arm is touched: a point would be a false one."""
    _, _, tau = touch(PANDA, Q, 0, 30.0)
    found = ISOLATOR.locate(Q, tau)
    assert found.region == "proximal"
    assert found.point_m is None
    assert found.point_covariance is None
    assert len(found.candidates_m) > 10


def test_turning_everything_turns_the_answer() -> None:
    """The base frame is a convention: an arm mounted otherwise has the same links, points and forces in itself."""
    _, _, tau = touch(PANDA, Q, 4, 20.0)
    a, b = np.cos(0.8), np.sin(0.8)
    R = np.array([[a, 0, b], [0, 1, 0], [-b, 0, a]]) @ np.array([[a, -b, 0], [b, a, 0], [0, 0, 1]])
    shift = np.array([0.3, -0.2, 0.1])
    moved = replace(
        PANDA,
        rotation=np.concatenate([[R @ PANDA.rotation[0]], PANDA.rotation[1:]]),
        translation=np.concatenate([[R @ PANDA.translation[0] + shift], PANDA.translation[1:]]),
        gravity=R @ PANDA.gravity,
        capsules=tuple(
            Capsule(-1, R @ c.p0_m + shift, R @ c.p1_m + shift, c.radius_m) if c.link < 0 else c for c in PANDA.capsules
        ),
    )
    here, there = ISOLATOR.locate(Q, tau), Isolator(moved).locate(Q, tau)
    np.testing.assert_allclose(there.link_probabilities, here.link_probabilities, atol=1e-9)
    np.testing.assert_allclose(there.candidates_m, here.candidates_m @ R.T + shift, atol=1e-9)
    np.testing.assert_allclose(there.force_n, R @ here.force_n, atol=1e-7)
    np.testing.assert_allclose(there.force_covariance, R @ here.force_covariance @ R.T, atol=1e-6)
    assert there.misfit == pytest.approx(here.misfit, abs=1e-8)


def test_second_contact_is_found_when_the_first_is_known() -> None:
    """A person who helps a stuck robot touches it further up while the tip is in contact."""
    tip = Dynamics(PANDA).jacobian(Q)
    first = np.array([3.0, -4.0, 12.0])
    now = first + np.array([0.8, 0.5, -1.0])  # it has drifted since it was known
    _, force, tau = touch(PANDA, Q, 4, 25.0)
    both = tau + tip[:3].T @ now
    known = KnownContact.at_frame(PANDA, Q, [*first, 0, 0, 0], np.diag([0.25, 0.25, 0.25, 0, 0, 0]), drift_n=1.5)
    found = ISOLATOR.locate(Q, both, known=[known])
    assert found.link == "panda_link5"
    assert np.linalg.norm(found.force_n - force) < 8.0
    assert not found.several
    assert ISOLATOR.locate(Q, both).several


def test_located_contact_serves_as_the_known_one() -> None:
    """What has been located is what is known: taking it out leaves nothing but noise."""
    _, _, tau = touch(PANDA, Q, 5, 20.0)
    first = ISOLATOR.locate(Q, tau)
    _, _, second = touch(PANDA, Q, 3, 20.0)
    rest = ISOLATOR.locate(Q, tau + second, known=[first.known(drift_n=1.0)])
    assert rest.link == "panda_link4"
    assert not rest.several


@pytest.mark.parametrize(
    "q",
    [np.zeros(7), np.array([0, 0, 0, -0.0698, 0, 0, 0]), np.array([0.0, 0, 0, -1.57, 0, 1.57, 0])],
    ids=["stretched", "almost stretched", "wrist"],
)
@pytest.mark.parametrize("tau", [np.zeros(7), np.eye(7)[6] * 5, 200.0 * np.ones(7)], ids=["nothing", "odd", "huge"])
def test_singular_poses_give_finite_answers(q: Array, tau: Array) -> None:
    """A prior on the force keeps every matrix regular: no pose and no torque may bring a nan."""
    found = ISOLATOR.locate(q, tau)
    for value in (found.link_probabilities, found.candidates_m, found.force_n, found.force_covariance):
        assert np.isfinite(value).all()
    assert np.isfinite([*found.magnitude_interval_n, found.misfit, found.explained]).all()


def test_links_that_others_cover_are_not_blamed() -> None:
    """Where links meet their capsules overlap, and inside nothing can touch: those cells must not count."""
    ISOLATOR.locate(Q, np.zeros(7))
    hidden = ~np.isfinite(ISOLATOR._grid.cells["log_p"])
    assert 0.01 < hidden.mean() < 0.7
    assert ISOLATOR._grid.cells["coverable"][hidden].all()


def test_robot_without_surface_is_refused() -> None:
    """An arm from a file may have no capsules; then a location would be made up."""
    with pytest.raises(TactfulError, match="capsules are empty"):
        Isolator(replace(PANDA, capsules=()))


def test_links_without_surface_are_left_out() -> None:
    """Some links may have no capsules; the others can still be told."""
    robot = replace(PANDA, capsules=tuple(c for c in PANDA.capsules if c.link >= 4))
    _, _, tau = touch(PANDA, Q, 5, 15.0)
    found = Isolator(robot).locate(Q, tau)
    assert found.link_probabilities[:4].sum() == 0
    assert np.isfinite(found.force_n).all()


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"q": np.zeros(6)}, r"q has shape \(6,\); panda needs \(7,\)"),
        ({"tau_ext": np.zeros((1, 7))}, r"tau_ext has shape \(1, 7\)"),
        ({"tau_ext": np.full(7, np.nan)}, "tau_ext has numbers that are not finite"),
        ({"covariance": np.eye(6)}, r"covariance has shape \(6, 6\)"),
        ({"covariance": -np.eye(7)}, "covariance is not positive definite"),
        ({"covariance": np.zeros((7, 7))}, "covariance is not positive definite"),
    ],
)
def test_bad_input_is_told(change: dict[str, Array], message: str) -> None:
    """A wrong shape must not be broadcast into an answer."""
    with pytest.raises(IsolationError, match=message):
        ISOLATOR.locate(**{"q": Q, "tau_ext": np.ones(7), **change})


def test_bad_known_contact_is_told() -> None:
    """The wrench of a known contact has six components; three would be broadcast to nonsense."""
    with pytest.raises(IsolationError, match="wrench of the known contact has shape"):
        ISOLATOR.locate(Q, np.ones(7), known=[KnownContact(
            link=6, point_m=np.zeros(3), wrench=np.zeros(3), covariance=np.eye(6)
        )])  # fmt: skip


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"noise_nm": (0.1, 0.1)}, "has 2 numbers"),
        ({"spacing_m": 0.01, "fine_spacing_m": 0.02}, "is wider than spacing_m"),
        ({"magnitudes_n": ()}, "magnitudes_n"),
        ({"spacing": 0.01}, "did you mean 'spacing_m'"),
    ],
)
def test_bad_settings_are_told(settings: dict[str, object], message: str) -> None:
    """A setting that cannot be must not wait for the first contact to show."""
    with pytest.raises(ConfigError, match=message):
        Isolator(PANDA, IsolationConfig(**settings))


def test_known_contact_at_a_frame_uses_its_place() -> None:
    """A frame may lie away from its link's origin: the wrench acts at the frame."""
    robot = replace(PANDA, frames={**PANDA.frames, "tool": Frame(6, np.eye(3), [0.0, 0.0, 0.3])})
    known = KnownContact.at_frame(robot, Q, np.zeros(6), np.eye(6), frame="tool")
    np.testing.assert_allclose(known.point_m, Dynamics(robot).pose(Q, "tool")[1])
    assert known.link == 6


def test_odds_tell_a_pair_from_a_single_contact() -> None:
    """Two unknown contacts make a single one look certain: something has to say that it is not to be believed."""
    limit = ISOLATOR.config.pair_log_odds
    tip = Dynamics(PANDA).jacobian(Q)[:3].T @ [-12.0, 9.0, 5.0]
    for link in (2, 3, 4):
        _, _, tau = touch(PANDA, Q, link, 20.0)
        assert ISOLATOR.pair_log_odds(Q, tau) < limit
        assert ISOLATOR.pair_log_odds(Q, tau + tip) > limit
    known = KnownContact.at_frame(PANDA, Q, [-12.0, 9.0, 5.0, 0, 0, 0], 0.1 * np.eye(6))
    assert ISOLATOR.pair_log_odds(Q, tau + tip, known=[known]) < limit
    with pytest.raises(IsolationError, match="tau_ext has shape"):
        ISOLATOR.pair_log_odds(Q, np.zeros(6))


def test_a_cell_whose_fine_points_are_covered_counts_as_it_is() -> None:
    """Where a neighbour hides all fine points of the only probable cell, there is an answer none the less."""
    q = [1.2038305046854672, 1.048177093422059, -0.2645745275557032, -2.669023978331642, -1.2637170680791976,
         1.1939612705004516, -0.5338135169915375]  # fmt: skip
    tau = [4.5463409985303125, 7.697604408945146, 9.161975327713206, 0.17682257875322258, 1.1166731826347154,
           3.1568527164356586, 0.029569026195025504]  # fmt: skip
    found = Isolator(Robot.load("panda")).locate(q, tau)
    assert found.link_probabilities.sum() == pytest.approx(1.0)
    assert np.isfinite(found.force_n).all()
