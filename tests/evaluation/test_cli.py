"""The verb `evaluate` on files."""

import json
from pathlib import Path

import numpy as np
import pytest

from tactful import Label, Recording, Robot
from tactful.cli._app import main
from tests.monitor._touched import Touch, recording


@pytest.fixture(autouse=True)
def _wide(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "200")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a collision, a push, and free motion, whose labels stand in `labels.json`."""
    path = tmp_path_factory.mktemp("set")
    panda = Robot.load("panda")
    labels = {"free.csv": []}
    for name, kind, force in (
        ("hit.csv", "collision", (0.0, -20.0, 0.0)),
        ("help.csv", "cooperation", (0.0, 18.0, 0.0)),
    ):
        recording(panda, Touch(1.5, 2.2, force), noise_nm=0.02).save(path / name)
        labels[name] = [Label(kind, 1.5, 2.2).to_dict()]
    recording(panda, noise_nm=0.02).save(path / "free.csv")
    for sidecar in path.glob("*.labels.json"):
        sidecar.unlink()
    (path / "labels.json").write_text(json.dumps(labels))
    return path


def test_folder_with_labels(folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """What the verb is for: a folder in, recall, latency, false alarms and confusion out, as a table and as JSON."""
    target = tmp_path / "out.json"
    assert main(["evaluate", str(folder), "--robot", "panda", "--json", str(target)]) == 0
    shown = capsys.readouterr().out
    for words in ("hit.csv", "2 of 2", "false alarms", "0 per hour [0, ", "specificity", "sensitivity", "accuracy"):
        assert words in shown
    assert "none: free" in shown
    report = json.loads(target.read_text())
    figures = report["figures"]
    assert figures["contacts"]["recall"]["value"] == 1
    assert figures["false_alarms"]["count"] == 0
    assert figures["specificity"]["count"] == figures["sensitivity"]["count"] == 1
    assert 0 < figures["contacts"]["latency_s"]["mean"] < 0.1
    assert {run["truth"] for run in report["recordings"]} == {"labels", "none: free"}
    assert report["config"]["robot"]["model"] == "panda"
    assert report["injected"] is None
    assert list(report["groups"]) == ["collision", "cooperation"]


def test_the_detector_is_named_as_for_monitor(folder: Path, tmp_path: Path) -> None:
    """Both detectors are compared on one set by one word."""
    target = tmp_path / "out.json"
    words = ["evaluate", str(folder / "hit.csv"), "--robot", "panda", "--mode", "paper", "--json", str(target)]
    assert main(words) == 0
    report = json.loads(target.read_text())
    assert report["config"]["mode"] == "paper"
    assert report["figures"]["contacts"]["recall"]["value"] == 1


def test_injection_is_repeatable(folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The tables of the documentation are made by this command: the same seed gives the same file."""
    targets = [tmp_path / name for name in ("a.json", "b.json", "c.json")]
    for target, seed in zip(targets, ("3", "3", "4"), strict=True):
        words = ["evaluate", str(folder / "free.csv"), "--robot", "panda", "--inject", "4", "--seed", seed]
        assert main([*words, "--json", str(target)]) == 0
    assert targets[0].read_text() == targets[1].read_text() != targets[2].read_text()
    report = json.loads(targets[0].read_text())
    assert report["injected"]["contacts"]["recall"]["total"] == 4
    assert report["injected"]["passes"] == 4
    assert report["figures"]["contact_free_s"] == pytest.approx(4.0, abs=0.01)
    assert {"impact", "push", "impact on the tip", "push on panda_link4"} <= set(report["groups"])
    assert "Injected in 4 passes" in capsys.readouterr().out


def test_the_truth_of_a_force_sensor(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Without labels, a force/torque sensor says what happened, and how well the force was estimated."""
    wrench = np.zeros((800, 6))
    wrench[300:600, 2] = -5.0
    path = tmp_path / "pad.csv"
    Recording(t=np.arange(800) / 80, channels={"wrench": wrench, "wrench_ft": wrench}).save(path)
    assert main(["evaluate", str(path)]) == 0
    shown = capsys.readouterr().out
    assert "F/T sensor" in shown
    assert "1 of 1" in shown
    assert "force error, RMS [N]" in shown


@pytest.mark.parametrize(
    ("labels", "line"),
    [
        ('{"run.csv": [{"kind": "bump", "start_s": 1, "end_s": 2}]}', "label 'bump' from 1 to 2 s: unknown kind; did"),
        ('{"run.csv": [{"kind": "contact", "start_s": 5, "end_s": 6}]}', "from 5 to 6 s lies outside the recording"),
        ('{"run.csv": [{"kind": "contact", "start_s": 2, "end_s": 1}]}', "ends at 1 s, before it begins at 2 s"),
        ('{"run.csv": [{"kind": "contact", "start_s": 1}]}', "'end_s' is missing"),
        ('{"rum.csv": []}', "labels a recording that is not there, 'rum.csv': did you mean 'run.csv'?"),
        ('{"run.csv": [', "the labels cannot be read"),
        ("[]", "expected an object with file names as keys"),
    ],
)
def test_labels_that_do_not_fit(tmp_path: Path, capsys: pytest.CaptureFixture[str], labels: str, line: str) -> None:
    """Each mistake that one makes in a label file ends in one line that names it."""
    Recording(t=np.arange(300) / 100, channels={"wrench": np.zeros((300, 6))}).save(tmp_path / "run.csv")
    for sidecar in tmp_path.glob("*.labels.json"):
        sidecar.unlink()
    (tmp_path / "labels.json").write_text(labels)
    assert main(["evaluate", str(tmp_path)]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert line.removesuffix("; did") in err
    assert err.startswith("tactful: ")
    assert err.count("\n") == 1


def test_other_bad_input(folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """No recording, no robot, a negative number, contacts into contacts: one line each."""

    def refused(*words: str) -> str:
        assert main(["evaluate", *words]) == 2
        out, err = capsys.readouterr()
        assert out == ""
        assert err.count("\n") == 1
        return err

    assert "holds no recording: they end in .bag, .csv" in refused(str(tmp_path))
    assert "which arm was recorded? Name it: --robot" in refused(str(folder))
    assert "whole numbers from 0 on" in refused(str(folder), "--inject", "-1")
    hit = str(folder / "hit.csv")
    assert "it has contacts already, the first at 1.5 s" in refused(hit, "--robot", "panda", "--inject", "2")
    assert "there is no such file" in refused(str(tmp_path / "gone.csv"))
    (tmp_path / "old.csv.labels.json").write_text('{"labels": []}')
    assert "labels a recording that is not there, 'old.csv'" in refused(str(tmp_path))
