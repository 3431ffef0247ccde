"""The study of isolation: that its contacts are what it says, that it is reproducible, and what it writes."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tactful import Robot, TactfulError
from tactful.cli._app import main
from tactful.dynamics import Dynamics
from tactful.isolation._surface import depth_in
from tactful.robots import Capsule
from tactful.studies.isolation import isolation_study
from tactful.studies.isolation._baselines import last_over_threshold, least_squares_link
from tactful.studies.isolation._draw import FRICTION, Draw
from tactful.studies.isolation._run import run
from tactful.studies.isolation._summary import METHODS
from tactful.studies.isolation._trials import NOISE_NM

PANDA = Robot.load("panda")


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict[str, Any]]:
    """A study as small as it may be."""
    out = tmp_path_factory.mktemp("study")
    shares: list[float] = []
    summary = isolation_study(PANDA, out, samples=60, seed=1, progress=shares.append)
    assert shares == sorted(shares)
    assert shares[-1] == pytest.approx(1.0)
    return out, summary


@pytest.mark.parametrize("name", ["panda", "ur5e"])
def test_contacts_are_drawn_from_the_surface(name: str) -> None:
    """The truth must lie on the arm, outside the other links, and push: else the rates are those of another task."""
    robot = Robot.load(name)
    draw, dynamics = Draw(robot, np.random.default_rng(0)), Dynamics(robot)
    touched = set()
    for _ in range(60):
        q, contact = draw.posed_contact()
        touched.add(contact.link)
        placed = []
        for capsule in robot.capsules:
            R, o = (np.eye(3), np.zeros(3)) if capsule.link < 0 else draw.link_pose(q, capsule.link)
            placed.append(Capsule(capsule.link, R @ capsule.p0_m + o, R @ capsule.p1_m + o, capsule.radius_m))
        depths = [float(depth_in(capsule, contact.point_m[None])[0]) for capsule in placed]
        assert max(depths) == pytest.approx(0.0, abs=1e-9)
        own = placed[int(np.argmax(depths))]
        assert own.link == contact.link
        deeper = contact.point_m + 1e-4 * contact.force_n / np.linalg.norm(contact.force_n)
        cosine = depth_in(own, deeper[None])[0] / 1e-4  # of the angle to the inward normal
        assert cosine > 1 / np.sqrt(1 + FRICTION**2) - 0.01
        assert 5 <= np.linalg.norm(contact.force_n) <= 40
        J = dynamics.jacobian_at(q, contact.link, contact.point_m)
        np.testing.assert_allclose(contact.torque_nm, J[:3].T @ contact.force_n)
        assert (q >= robot.lower).all()
        assert (q <= robot.upper).all()
    assert len(touched) >= robot.n - 1


def test_baselines_find_a_contact_without_noise() -> None:
    """A baseline that was wrong by construction would make anything look good."""
    draw, dynamics = Draw(PANDA, np.random.default_rng(3)), Dynamics(PANDA)
    exact = {"threshold": 0, "least squares": 0}
    for _ in range(100):
        q, contact = draw.posed_contact()
        exact["threshold"] += last_over_threshold(contact.torque_nm, 1e-6) == contact.link
        exact["least squares"] += least_squares_link(dynamics, q, contact.torque_nm, 1e-3) == contact.link
    assert exact["threshold"] > 95
    assert exact["least squares"] > 80


def test_evidence_beats_the_baselines(results: tuple[Path, dict[str, Any]]) -> None:
    """The order of the methods is what the study is for; sixty contacts show it."""
    _, summary = results
    row = next(row for row in summary["links"] if row["noise_nm"] == NOISE_NM)
    exact = {name: row[name]["exact"]["value"] for name in METHODS}
    assert exact["evidence"] > max(value for name, value in exact.items() if name != "evidence")
    assert exact["evidence"] > 0.75


def test_every_rate_has_an_interval(results: tuple[Path, dict[str, Any]]) -> None:
    """A rate without what it leaves open, or without its origin, is not a result."""
    out, summary = results
    assert "simulation" in summary["origin"]
    checked = 0

    def check(node: Any) -> None:
        nonlocal checked
        if isinstance(node, list):
            for item in node:
                check(item)
        elif isinstance(node, dict):
            if "low" in node and "count" in node:
                assert node["value"] is None or node["low"] <= node["value"] <= node["high"]
                checked += 1
            for item in node.values():
                check(item)

    check(summary)
    assert checked > 100
    assert json.loads((out / "summary.json").read_text()) == summary
    text = (out / "tables.md").read_text()
    for title in (line for line in text.splitlines() if line.startswith("## ")):
        assert "(simulation)" in title
    assert "nan" not in text


def test_pictures_are_drawn(results: tuple[Path, dict[str, Any]]) -> None:
    """The figures come with the tables."""
    out, _ = results
    for name in ("links", "calibration", "motion"):
        assert (out / f"{name}.svg").read_text().startswith("<?xml")


def test_result_depends_on_the_seed_alone(results: tuple[Path, dict[str, Any]], tmp_path: Path) -> None:
    """Two processes must bring what one does, and another seed something else."""
    out, summary = results
    again = isolation_study(PANDA, tmp_path, samples=60, seed=1, jobs=2)
    assert again == summary
    for name in ("summary.json", "tables.md", "links.svg"):
        assert (tmp_path / name).read_bytes() == (out / name).read_bytes()
    other = run(PANDA, 20, 2, 1)
    assert not np.array_equal(other["links", ""]["true"][:20], run(PANDA, 20, 3, 1)["links", ""]["true"][:20])


@pytest.mark.parametrize(("samples", "jobs", "seed"), [(3, 1, 0), (100, 0, 0), (100, 1, -1)])
def test_bad_numbers_are_told(samples: int, jobs: int, seed: int) -> None:
    """A study of nothing has no rates."""
    with pytest.raises(TactfulError, match="has to be at least"):
        run(PANDA, samples, seed, jobs)


def test_verb_writes_and_tells(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """`tactful study isolation` is how anyone reproduces the tables."""
    out = tmp_path / "new" / "folder"
    words = ["study", "isolation", "--robot", "ur5e", "--samples", "20", "--jobs", "1", "--out", str(out)]
    assert main(words) == 0
    shown = capsys.readouterr()
    assert "ur5e, simulated contacts" in shown.out
    assert "an update takes" in shown.err
    assert sorted(path.name for path in out.iterdir()) == [
        "calibration.svg", "links.svg", "motion.svg", "summary.json", "tables.md",
    ]  # fmt: skip


def test_bad_words_are_told(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Bad input ends in one line and 2; `study` alone shows which studies there are."""
    assert main(["study", "isolation", "--robot", "nope", "--out", str(tmp_path)]) == 2
    assert "no robot is called 'nope'" in capsys.readouterr().err
    assert main(["study", "isolation", "--samples", "1", "--out", str(tmp_path)]) == 2
    assert main(["study"]) == 0
    assert "isolation" in capsys.readouterr().out
