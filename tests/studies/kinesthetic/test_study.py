"""The kinesthetic study as a whole, in small."""

from __future__ import annotations

import json
import math
import re
from pathlib import Path

import pytest

from tactful.cli._app import main
from tactful.errors import TactfulError
from tactful.studies.kinesthetic import kinesthetic_study
from tests.studies.kinesthetic._tiny import FREE, TOUCHED, make_tiny

BLOCK = {
    "accuracy",
    "specificity",
    "sensitivity",
    "collision_latency_ms",
    "cooperation_latency_ms",
    "misses",
    "false_alarms_per_hour",
    "spurious_cooperation_rate",
    "events_per_contact",
    "per_operator",
}


@pytest.mark.timeout(600)
def test_writes_summary_tables_and_report(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """The keys are what others read; the report needs nothing else; a second call simulates and monitors nothing."""
    make_tiny(monkeypatch)
    assert main(["study", "kinesthetic", "--episodes", "9", "--jobs", "1", "--out", str(tmp_path)]) == 0
    assert "missed from 6 N on" in capsys.readouterr().out
    summary = json.loads((tmp_path / "summary.json").read_text(encoding="utf-8"))
    for key in ("paper", "best", "best_without_location"):
        assert set(summary[key]) >= BLOCK
        for share in ("accuracy", "specificity", "sensitivity", "spurious_cooperation_rate"):
            assert set(summary[key][share]) >= {"value", "low", "high"}
    assert summary["simulated"]["evaluation"]["episodes"] == len(TOUCHED)
    assert summary["best"]["contacts"] >= len(TOUCHED)
    report = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert not re.search(r"<(script|link)|(src|href)=\"http", report)
    assert report.count("data:image/") >= 5
    assert "simulation" in (tmp_path / "tables.md").read_text(encoding="utf-8")

    before = {file: file.stat().st_mtime_ns for file in (tmp_path / "rows").iterdir()}
    episodes = {file: file.stat().st_mtime_ns for file in (tmp_path / "episodes").glob("*.parquet")}
    assert len(episodes) == len(FREE) + len(TOUCHED)
    again = kinesthetic_study(tmp_path, episodes=9)
    assert again == summary
    assert episodes == {file: file.stat().st_mtime_ns for file in (tmp_path / "episodes").glob("*.parquet")}
    assert {file.name: file.stat().st_size for file in before} == {
        file.name: file.stat().st_size for file in (tmp_path / "rows").iterdir()
    }


@pytest.mark.timeout(600)
def test_runs_on_a_dask_cluster(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A real scheduler and two workers on loopback: what goes there and back has to survive it."""
    distributed = pytest.importorskip("distributed")
    make_tiny(monkeypatch)
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, host="127.0.0.1", dashboard_address="127.0.0.1:0"
    ) as cluster:
        shares: list[float] = []
        summary = kinesthetic_study(tmp_path, episodes=9, scheduler=cluster.scheduler_address, progress=shares.append)
    assert summary["best"]["contacts"] >= len(TOUCHED)
    assert shares == sorted(shares)
    assert math.isclose(shares[-1], 1.0)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"jobs": 0}, "jobs is 0"),
        ({"episodes": 2}, "at least 9"),
        ({"seed": -1}, "at least 9 and 0"),
        ({"scheduler": "tcp://127.0.0.1:9"}, "no Dask scheduler answers"),
    ],
)
def test_bad_input(options: dict[str, object], message: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """One line says what is wrong."""
    monkeypatch.setattr("tactful.studies._parallel._CONNECT_S", 0.5)
    with pytest.raises(TactfulError, match=message):
        kinesthetic_study(tmp_path, **options)  # type: ignore[arg-type]
