"""The verb `monitor`, as a user calls it."""

import json
from pathlib import Path

import numpy as np
import pytest

from tactful import Recording
from tactful.cli._app import main
from tests._counterparts import require_shared_data


@pytest.fixture
def log(tmp_path: Path) -> Path:
    """A wrench with one contact, in a CSV file."""
    t = np.arange(3000) / 1000
    wrench = np.zeros((3000, 6))
    wrench[1500:2000, 0] = 8.0
    path = tmp_path / "touch.csv"
    Recording(t=t, channels={"wrench": wrench}, source="touch", format="made").save(path)
    return path


def test_a_table_for_people(log: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """When, how long, what, how hard, along what, and why."""
    assert main(["monitor", str(log)]) == 0
    out = capsys.readouterr().out
    assert "1.499" in out
    assert "contact" in out
    assert "8.0" in out
    assert "3000 samples" in out


def test_json_lines_and_nothing_else_on_stdout(log: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A pipe into another program sees one object a line; the rest goes to stderr."""
    assert main(["monitor", str(log), str(log), "--json"]) == 0
    events = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    assert [event["recording"] for event in events] == [str(log)] * 2
    assert {"kind", "onset_s", "detected_s", "end_s", "link", "directions", "force_n", "confidence"} <= events[0].keys()


def test_pictures_and_events_are_saved_for_each_recording(log: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """With several recordings no file overwrites another."""
    other = log.with_name("other.csv")
    other.write_bytes(log.read_bytes())
    (log.with_name(log.stem + ".labels.json")).unlink(missing_ok=True)
    folder = log.parent
    assert (
        main(["monitor", str(log), str(other), "--plot", str(folder / "p.png"), "--save", str(folder / "e.jsonl")]) == 0
    )
    assert {path.name for path in folder.iterdir()} >= {
        "p_touch.png",
        "p_other.png",
        "e_touch.jsonl",
        "e_other.jsonl",
    }


def test_skipped_samples_end_in_1(log: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A script can tell a clean run from one in which samples were bad."""
    lines = log.read_text().splitlines()
    lines[700] = ",".join([lines[700].split(",")[0], *["nan"] * (len(lines[0].split(",")) - 1)])
    log.write_text("\n".join(lines) + "\n")
    assert main(["monitor", str(log)]) == 1
    assert "degraded" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["nowhere.csv"], "nowhere.csv"),
        (["{log}", "--robot", "pandaa"], "did you mean 'panda'?"),
        (["{log}", "--robot", "panda", "--tip", "hand"], "hand"),
        (["{log}", "--config", "nowhere.toml"], "nowhere.toml"),
        (["{log}", "--mode", "slow"], "--mode"),
        (["{log}", "--plot", "nowhere/p.png"], "nowhere"),
        (["{log}", "--save", "events.xls"], ".parquet or .jsonl"),
        ([], "file"),
    ],
)
def test_bad_input_is_one_line_and_2(
    log: Path, arguments: list[str], message: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Whatever a user can get wrong in this command."""
    monkeypatch.chdir(log.parent)
    assert main(["monitor", *(word.format(log=log) for word in arguments)]) == 2
    error = [line for line in capsys.readouterr().err.splitlines() if line.startswith("tactful:")]
    assert len(error) == 1
    assert message.lower() in error[0].lower()


def test_a_log_of_joints_asks_for_its_robot(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Guessing the arm would give a wrong force in silence."""
    path = tmp_path / "joints.csv"
    zeros = np.zeros((2000, 7))
    channels = {"q": zeros, "dq": zeros, "tau": zeros}
    Recording(t=np.arange(2000) / 1000, channels=channels, source="j", format="made").save(path)
    assert main(["monitor", str(path)]) == 2
    assert "which arm was recorded? Name it: --robot" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("name", "start_s", "end_s"), [("1", 2.59, 9.14), ("2", 3.51, 9.25), ("3", 2.31, 10.41), ("4", 2.89, 9.21)]
)
def test_the_presses_on_a_real_pad(name: str, start_s: float, end_s: float, capsys: pytest.CaptureFixture[str]) -> None:
    """A person presses a real Panda once in each recording; the F/T sensor's times of more than 1 N are the truth."""
    path = require_shared_data() / "panda_tactile_pad" / f"data_pos_{name}.csv"
    assert main(["monitor", str(path), "--json"]) == 0
    (event,) = (json.loads(line) for line in capsys.readouterr().out.splitlines())
    assert event["onset_s"] == pytest.approx(start_s, abs=0.1)
    assert event["detected_s"] - start_s < 0.25
    assert event["end_s"] == pytest.approx(end_s, abs=0.1)
    assert event["kind"] == "contact"


def test_a_real_panda_in_motion_runs(capsys: pytest.CaptureFixture[str]) -> None:
    """Ten seconds of a real arm, irregular stamps and repeated rows: monitored, and not degraded by them."""
    path = require_shared_data() / "panda_free_motion" / "exciting_first_10s.csv"
    assert main(["monitor", str(path), "--robot", "panda"]) == 0
    assert "540 repeated" in capsys.readouterr().out


def test_a_planned_impact(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """With a plan, the blow that was intended is no collision; a plan that is none is told in one line."""
    from tactful.impacts import ImpactPlan
    from tactful.robots import Robot

    t = np.arange(2000) / 1000
    home = Robot.load("panda").home
    tau_ext = np.where(t[:, None] >= 1.2, 30.0, 0.0) * np.eye(7)[1]
    channels = {"q": np.tile(home, (2000, 1)), "dq": np.zeros((2000, 7)), "tau_ext": tau_ext}
    Recording(t=t, channels=channels, source="blow").save(tmp_path / "blow.npz")
    ImpactPlan(1.2, home, [1.2], np.zeros((1, 7))).save(tmp_path / "plan.npz")
    config = tmp_path / "monitor.toml"
    config.write_text("[aim_aware.impact]\nr_b_nm_s = 500.0\n")
    arguments = ["monitor", str(tmp_path / "blow.npz"), "--robot", "panda", "--config", str(config), "--json"]
    assert main([*arguments, "--plan", str(tmp_path / "plan.npz")]) == 0
    (event,) = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    assert (event["kind"], event["reason"]) == ("expected_impact", None)
    assert main(arguments) == 0
    assert "impact" not in json.loads(capsys.readouterr().out.splitlines()[0])["kind"]
    assert main([*arguments, "--plan", str(config)]) == 2
    assert "not an impact plan" in capsys.readouterr().err
