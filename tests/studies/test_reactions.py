"""The study of reactions: that it compares like with like, is reproducible, and writes what it found."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from tactful import TactfulError
from tactful.cli._app import main
from tactful.studies.reactions import reactions_study
from tactful.studies.reactions._trials import POLICIES, collide


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict[str, Any]]:
    """A study as small as it may be."""
    out = tmp_path_factory.mktemp("study")
    assert main(["study", "reactions", "--samples", "2", "--jobs", "1", "--seed", "5", "--out", str(out)]) == 0
    return out, json.loads((out / "summary.json").read_text())


def test_reactions_lower_what_presses(results: tuple[Path, dict[str, Any]]) -> None:
    """The order of the reactions is what the study is for; two collisions show it."""
    _, summary = results
    rows = summary["reactions"]
    assert set(rows) == set(POLICIES)
    assert summary["origin"] == "simulation"
    assert rows["stop"]["peak_share"]["mean"] < 1
    assert rows["stop"]["later_n"]["median"] < 0.2 * rows["continue"]["later_n"]["median"]
    assert rows["retract"]["contact_s"]["median"] < 0.3 * rows["continue"]["contact_s"]["median"]


def test_table_says_where_it_comes_from(results: tuple[Path, dict[str, Any]]) -> None:
    """A figure from simulation must not be taken for one of a robot."""
    out, summary = results
    text = (out / "tables.md").read_text()
    assert "**From simulation**" in text
    assert text.count("\n| ") == 2 + len(summary["reactions"])
    assert "nan" not in text


def test_all_reactions_meet_the_same_collision() -> None:
    """A comparison of different collisions would compare posts; and a seed decides everything."""
    first = collide((5, 0), "stop")
    assert collide((5, 0), "stop") == first
    assert collide((5, 0), "retract")["speed_m_s"] == first["speed_m_s"]
    assert collide((5, 1), "stop") != first


def test_bad_numbers_are_told(tmp_path: Path) -> None:
    """A study of nothing has no figures."""
    with pytest.raises(TactfulError, match="samples is 1: it has to be at least 2"):
        reactions_study(tmp_path, samples=1)
