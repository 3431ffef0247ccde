"""The aim-aware study as a whole."""

import json
from pathlib import Path

import numpy as np
import pytest

from tactful.cli._app import main
from tactful.errors import TactfulError
from tactful.simulation.planar import PlanarConfig
from tactful.studies.aim_aware import _summary, aim_aware_study, cases


@pytest.fixture
def _small(monkeypatch: pytest.MonkeyPatch) -> None:
    few = cases([80.0], [0.3], np.arange(-6.0, 6.1, 1.0))
    for name in ("training", "held_out", "paper_grid"):
        monkeypatch.setattr(_summary, name, lambda *arguments: few)
    every = list(_summary.variants(PlanarConfig()))
    monkeypatch.setattr(_summary, "variants", lambda base: [every[0], every[-2]])


@pytest.mark.usefixtures("_small")
def test_writes_figures_tables_and_pictures(tmp_path: Path) -> None:
    """The keys are what others read; the numbers are those of a small part of the sweep."""
    shares: list[float] = []
    summary = aim_aware_study(tmp_path, progress=shares.append)
    assert shares[-1] == pytest.approx(1.0)
    stored = json.loads((tmp_path / "summary.json").read_text(encoding="utf-8"))
    assert stored == json.loads(json.dumps(summary))
    for group in ("table1", "tuned"):
        for name in ("strict", "medium", "wide"):
            found = stored[group][name]
            for part in (found, found["held_out"]):
                assert set(part) >= {"band_deg", "ambiguous_deg", "accepted_beyond"}
    for name, B in (("strict", 0), ("medium", 2), ("wide", 4)):
        low, high = stored["tuned"][name]["band_deg"]
        assert low <= -B
        assert high >= B
    assert {"cpu_s", "inclination_mae_deg", "robustness"} <= set(stored)
    assert stored["inclination_mae_deg"] < 1.0
    assert "Tab. 1 verbatim" in (tmp_path / "tables.md").read_text(encoding="utf-8")
    for figure in ("fig6.svg", "fig7.svg"):
        assert (tmp_path / figure).stat().st_size > 5000


@pytest.mark.usefixtures("_small")
def test_command_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The verb prints the targets with what was reached."""
    assert main(["study", "aim-aware", "--jobs", "1", "--out", str(tmp_path)]) == 0
    assert "inclination, held out" in capsys.readouterr().out


def test_bad_input(tmp_path: Path) -> None:
    """One line says what is wrong."""
    with pytest.raises(TactfulError, match="grid"):
        aim_aware_study(tmp_path, grid="coarse")  # type: ignore[arg-type]
    with pytest.raises(TactfulError, match="seed"):
        aim_aware_study(tmp_path, seed=-1)
