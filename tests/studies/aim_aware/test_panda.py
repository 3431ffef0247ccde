"""The experiment of the aim-aware paper with a simulated arm."""

import json
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("mujoco")

from tactful.cli._app import main
from tactful.errors import TactfulError
from tactful.studies.aim_aware import _panda_runs, _panda_summary, panda_study

FEW_DEG = np.array([-10.0, -4.0, 0.0, 8.0, 10.0])


def _shrink(patch: pytest.MonkeyPatch) -> None:
    """Leave one approach, few inclinations, few trials and no variants."""
    for module in (_panda_summary, _panda_runs):
        patch.setattr(module, "BETA_DEG", FEW_DEG)
        patch.setattr(module, "NOMINAL", 2)
    patch.setattr(_panda_runs, "ALPHA_DEG", (110.0,))
    patch.setattr(_panda_summary, "TRAINING_DEG", FEW_DEG)
    patch.setattr(_panda_summary, "_TRIALS", 3)
    patch.setattr(_panda_summary, "_TRIALS_TILT", 3)
    patch.setattr(_panda_summary, "variants", lambda bench: {})


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a small study, by the command line, in which a planar one has been."""
    out = tmp_path_factory.mktemp("panda")
    (out / "summary.json").write_text('{"grid": "paper"}', encoding="utf-8")
    with pytest.MonkeyPatch.context() as patch:
        _shrink(patch)
        assert main(["study", "aim-aware", "--robot", "panda", "--jobs", "1", "--out", str(out)]) == 0
    return out


def test_summary_has_both_references(study: Path) -> None:
    """The keys are what others read; what stood in the folder before stays."""
    stored = json.loads((study / "summary.json").read_text(encoding="utf-8"))
    assert stored["grid"] == "paper"
    panda = stored["panda"]
    assert panda["impacts"] == len(FEW_DEG)
    for reference in ("data_driven", "model_based"):
        for group, names in (("table2", {"strict", "wide"}), ("tuned", {"strict", "wide", "symmetric"})):
            assert set(panda[reference][group]) == names
            for found in panda[reference][group].values():
                assert set(found) >= {"band_deg", "ambiguous_deg", "accepted_beyond", "rate", "settings"}
    assert panda["data_driven"]["table2"]["strict"]["settings"]["e_m_rad_s"] == 0.18
    assert panda["data_driven"]["table2"]["strict"]["band_deg"] == [0.0, 0.0]
    assert panda["data_driven"]["tuned"]["symmetric"]["band_deg"] == [-4.0, 0.0]


def test_report_and_pictures(study: Path) -> None:
    """The report stands alone, with its figures inside, and says what was assumed."""
    for figure in ("fig8.svg", "fig6b.svg"):
        assert (study / figure).stat().st_size > 5000
    page = (study / "report.html").read_text(encoding="utf-8")
    assert page.count("data:image/svg+xml;base64,") == 2
    assert "Assumed:" in page
    assert "Tab. 2 verbatim, strict" in (study / "tables.md").read_text(encoding="utf-8")


def test_evidence_gives_the_rates_again(study: Path) -> None:
    """Other thresholds can be tried without another simulation."""
    panda = json.loads((study / "summary.json").read_text(encoding="utf-8"))["panda"]
    stored = panda["data_driven"]["tuned"]["wide"]
    with np.load(study / "evidence_panda.npz") as evidence:
        needed, cases = evidence["data_driven_tuned_wide"], evidence["cases"]
    limits = [stored["settings"][name] for name in ("e_m_rad_s", "epsilon_rad", "zeta_s", "iota_s")]
    accepted = (needed[:, :4] <= limits).all(axis=1)
    assert accepted[np.argsort(cases[:, 1])].astype(float).tolist() == stored["rate"]


@pytest.mark.timeout(600)
def test_runs_on_a_dask_cluster(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, study: Path) -> None:
    """A real scheduler and two workers on loopback find what one process finds."""
    distributed = pytest.importorskip("distributed")
    _shrink(monkeypatch)
    monkeypatch.setattr(_panda_summary, "WANTED", {"wide": (0.0, 8.0)})
    shares: list[float] = []
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, host="127.0.0.1", dashboard_address="127.0.0.1:0"
    ) as cluster:
        found = panda_study(tmp_path, scheduler=cluster.scheduler_address, progress=shares.append)
    alone = json.loads((study / "summary.json").read_text(encoding="utf-8"))["panda"]
    for reference in ("data_driven", "model_based"):
        for name, bands in alone[reference]["table2"].items():
            assert found[reference]["table2"][name]["rate"] == bands["rate"]
    assert shares == sorted(shares)
    assert shares[-1] == pytest.approx(1.0)


def test_runs_share_no_noise() -> None:
    """What is tuned on, what is reported, and what the reference comes from are different runs, of the same seed."""
    tasks = [
        task
        for use in ("nominal", "tune", "report")
        for task in _panda_runs.strike_tasks(_panda_summary.BenchConfig(), use, [0.0, 0.0, 2.0], 0)
    ]
    cases = [
        (task.alpha_deg, beta, seed) for task in tasks for beta, seed in zip(task.beta_deg, task.seeds, strict=True)
    ]
    assert len(set(cases)) == len(cases) == 3 * 3 * len(_panda_runs.ALPHA_DEG)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"seed": -1}, "seed"),
        ({"jobs": 0}, "jobs"),
        ({"scheduler": "tcp://127.0.0.1:9"}, "no Dask scheduler answers"),
    ],
)
def test_bad_input(options: dict[str, object], message: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """One line says what is wrong."""
    monkeypatch.setattr("tactful.studies._parallel._CONNECT_S", 0.5)
    with pytest.raises(TactfulError, match=message):
        panda_study(tmp_path, **options)  # type: ignore[arg-type]


def test_other_bad_input(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A grid of the planar arm, and a folder with something else in it."""
    arguments = ["study", "aim-aware", "--robot", "panda", "--out", str(tmp_path)]
    assert main([*arguments, "--grid", "fine"]) == 2
    (tmp_path / "summary.json").write_text("torn {", encoding="utf-8")
    assert main(arguments) == 2
    assert "choose another folder" in " ".join(capsys.readouterr().err.split())
