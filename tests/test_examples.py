"""An example that does not run teaches the wrong thing."""

import os
import runpy
from pathlib import Path

import pytest

EXAMPLES = sorted((Path(__file__).parents[1] / "examples").glob("[0-9]*.py"))


def test_there_are_examples() -> None:
    """So that a moved folder does not pass for none that fails."""
    assert len(EXAMPLES) >= 3


@pytest.mark.parametrize("example", EXAMPLES, ids=lambda path: path.stem)
def test_example_runs_and_says_something(example: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Each is a whole program; the first two end with the collision that is there."""
    runpy.run_path(os.fspath(example), run_name="__main__")
    out = capsys.readouterr().out
    assert "collision" in out or "stop" in out
