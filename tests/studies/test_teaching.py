"""The study of teaching: its draw, its counting, its output, and bad input."""

from pathlib import Path

import pytest

from tactful.errors import TactfulError
from tactful.simulation import OPERATORS
from tactful.studies.teaching import draw_trials, teaching_study
from tactful.studies.teaching._summary import summarise
from tactful.studies.teaching._tables import tables
from tactful.studies.teaching._trials import TRAJECTORIES, Trial


def made(trajectory: str, *, before: bool, after: bool, told: bool | None) -> Trial:
    """Return a trial."""
    return Trial(
        trajectory=trajectory, operator="calm", before=before, cooperation=told, latency_s=0.2 if told else None,
        problem=None if told else "the hand led the tip 1 mm far", after=after, peak_n=(30.0, 2.0), ways={},
    )  # fmt: skip


def test_draw_is_balanced_and_repeatable() -> None:
    """A rate over trajectories means little if one of them is rare; a seed has to give the same again."""
    specs = draw_trials(108, 3, "panda")
    assert {name: sum(spec.trajectory == name for spec in specs) for name in TRAJECTORIES} == dict.fromkeys(
        TRAJECTORIES, 36
    )
    assert {spec.operator for spec in specs} == set(OPERATORS)
    assert specs == draw_trials(108, 3, "panda")
    assert specs[0].seed != draw_trials(1, 4, "panda")[0].seed


def test_figures_count_what_they_say() -> None:
    """Before and after are of all executions, the rest of those that were helped."""
    rows = [
        made("border", before=True, after=True, told=None),
        made("side", before=False, after=True, told=True),
        made("top", before=False, after=False, told=False),
    ]
    summary = summarise({"clean": rows}, 0, "rules")
    figures = summary["presets"]["clean"]
    assert (figures["all"]["before"]["count"], figures["all"]["after"]["count"]) == (1, 2)
    assert figures["helped"] == 2
    assert (figures["after_failure"]["count"], figures["after_failure"]["total"]) == (1, 2)
    assert figures["recognised"]["count"] == figures["merged"]["count"] == 1
    assert figures["by_trajectory"]["side"]["after"]["value"] == 1.0
    assert "| side | 0 % [0, 79] | 100 % [21, 100] | 1 |" in tables(summary)


@pytest.mark.parametrize(
    ("wrong", "named"), [({"seeds": 0}, "seeds is 0"), ({"jobs": 0}, "jobs is 0"), ({"seed": -1}, "seed is -1")]
)
def test_bad_input_is_told(wrong: dict[str, int], named: str, tmp_path: Path) -> None:
    """A slip in an option ends in one line, before anything is computed."""
    with pytest.raises(TactfulError, match=named):
        teaching_study(tmp_path / "out", **wrong)  # type: ignore[arg-type]
    with pytest.raises(TactfulError, match="neither learned nor rules"):
        teaching_study(tmp_path / "out", classifier=str(tmp_path / "none.npz"))
    assert not (tmp_path / "out").exists()
