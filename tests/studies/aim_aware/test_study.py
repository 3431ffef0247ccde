"""The aim-aware study as a whole."""

import json
from pathlib import Path

import numpy as np
import pytest

from tactful.cli._app import main
from tactful.errors import TactfulError
from tactful.simulation.planar import PlanarConfig
from tactful.studies.aim_aware import _summary, aim_aware_study, cases
from tactful.studies.aim_aware._variants import FRICTION, variants


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a study of a small part of the sweep, by the command line."""
    few = cases([80.0], [0.3], np.arange(-6.0, 6.1, 1.0))
    every = [variant for variant in variants(PlanarConfig()) if variant.name in ("as assumed", FRICTION)]
    out = tmp_path_factory.mktemp("aim-aware")
    with pytest.MonkeyPatch.context() as patch:
        for name in ("training", "held_out", "paper_grid"):
            patch.setattr(_summary, name, lambda *arguments: few)
        for name in ("_TRIALS", "_TRIALS_VARIANT"):
            patch.setattr(_summary, name, 4)
        patch.setattr(_summary, "variants", lambda base: every)
        assert main(["study", "aim-aware", "--jobs", "1", "--out", str(out)]) == 0
    return out


def test_summary_has_what_others_read(study: Path) -> None:
    """The keys are what others read; the numbers are those of a small part of the sweep."""
    stored = json.loads((study / "summary.json").read_text(encoding="utf-8"))
    assert {"cpu_s", "inclination_mae_deg", "robustness"} <= set(stored)
    for group in ("table1", "tuned", "tilt", "early"):
        for name in ("strict", "medium", "wide"):
            found = stored[group][name]
            for part in (found, found["held_out"]):
                assert set(part) >= {"band_deg", "ambiguous_deg", "accepted_beyond"}
    for name, B in (("strict", 0), ("medium", 2), ("wide", 4)):
        low, high = stored["tuned"][name]["band_deg"]
        assert low <= -B
        assert high >= B
        assert stored["tilt"][name]["band_deg"] == [-B, B]
    assert stored["inclination_mae_deg"] < 1.0
    assert [row["variant"] for row in stored["robustness"]] == ["as assumed", FRICTION]
    assert all(row["tilt"]["medium"]["kept"] for row in stored["robustness"])
    waits = [row["met"] for row in stored["targets"] if row["what"].startswith("verdict")]
    assert waits == [True, False, True]


def test_report_tables_and_pictures(study: Path) -> None:
    """The report stands alone, with its figures inside."""
    assert "Tab. 1 verbatim" in (study / "tables.md").read_text(encoding="utf-8")
    for figure in ("fig6.svg", "fig7.svg"):
        assert (study / figure).stat().st_size > 5000
    page = (study / "report.html").read_text(encoding="utf-8")
    assert page.count("data:image/svg+xml;base64,") == 2
    assert "http" not in page


def test_evidence_gives_the_rates_again(study: Path) -> None:
    """Other thresholds can be tried without another simulation."""
    stored = json.loads((study / "summary.json").read_text(encoding="utf-8"))["tuned"]["wide"]
    with np.load(study / "evidence.npz") as evidence:
        needed, cases = evidence["grid_tuned_wide"], evidence["grid_cases"]
    names = ("e_m_rad_s", "epsilon_rad", "zeta_s", "iota_s")
    limits = [stored["settings"][name] for name in names]
    accepted = (needed[:, :4] <= limits).all(axis=1)
    assert accepted[np.argsort(cases[:, 2])].astype(float).tolist() == stored["rate"]


def test_bad_input(tmp_path: Path) -> None:
    """One line says what is wrong."""
    with pytest.raises(TactfulError, match="grid"):
        aim_aware_study(tmp_path, grid="coarse")  # type: ignore[arg-type]
    with pytest.raises(TactfulError, match="seed"):
        aim_aware_study(tmp_path, seed=-1)
    with pytest.raises(TactfulError, match="jobs"):
        aim_aware_study(tmp_path, jobs=0)


@pytest.mark.parametrize(
    "arguments", [["study", "aim-aware"], ["study", "aim-aware", "--robot", "panda"], ["demo", "--impact"]]
)
def test_a_place_that_is_no_folder(arguments: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """It is told before the minutes of work, not after them."""
    file = tmp_path / "file"
    file.touch()
    assert main([*arguments, "--out", str(file)]) == 2
    shown = capsys.readouterr()
    assert shown.out == ""
    assert shown.err.count("\n") == 1
    assert "File exists" in shown.err


@pytest.mark.timeout(600)
def test_runs_on_a_dask_cluster(tmp_path: Path) -> None:
    """A real scheduler and two workers on loopback: what goes there and back has to survive it."""
    distributed = pytest.importorskip("distributed")
    few = cases([80.0], [0.3], np.arange(-6.0, 6.1, 2.0))
    every = [variant for variant in variants(PlanarConfig()) if variant.name in ("as assumed", FRICTION)]
    shares: list[float] = []
    with (
        pytest.MonkeyPatch.context() as patch,
        distributed.LocalCluster(
            n_workers=2, threads_per_worker=1, host="127.0.0.1", dashboard_address="127.0.0.1:0"
        ) as cluster,
    ):
        for name in ("training", "held_out", "paper_grid"):
            patch.setattr(_summary, name, lambda *arguments: few)
        for name in ("_TRIALS", "_TRIALS_VARIANT"):
            patch.setattr(_summary, name, 4)
        patch.setattr(_summary, "variants", lambda base: every)
        summary = aim_aware_study(tmp_path, scheduler=cluster.scheduler_address, progress=shares.append)
    assert summary["impacts"] == len(few)
    assert shares == sorted(shares)
    assert shares[-1] == pytest.approx(1.0)
