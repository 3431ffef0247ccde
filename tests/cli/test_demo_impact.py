"""The demonstration of planned impacts."""

from pathlib import Path

import pytest

from tactful.cli._app import main


def test_one_as_planned_and_one_that_is_not(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Somebody who sees it for the first time has to see both verdicts, and why, and a picture."""
    assert main(["demo", "--impact", "--out", str(tmp_path), "--seed", "1"]) == 0
    shown = capsys.readouterr().out
    for word in ("expected impact", "unexpected impact", "reason", "0.0 deg", "5.0 deg", "impact.png"):
        assert word in shown
    assert (tmp_path / "impact.png").stat().st_size > 20_000
