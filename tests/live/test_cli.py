"""`tactful live`: what it prints, how it ends, and what it refuses."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from tactful import Recording
from tactful.cli._app import main
from tactful.live import read_log
from tactful.live.sources.sim import CONFIG
from tests.live._fake import PANDA

pytestmark = pytest.mark.timeout(300)  # kernels may have to be compiled


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, str]:
    """A recorded run of the cell, and what was printed."""
    path = tmp_path_factory.mktemp("live") / "run.parquet"
    words = ["live", "--source", "sim", "--speed", "0", "--duration", "4", "--json", "--record", str(path)]
    done = subprocess.run([sys.executable, "-m", "tactful", *words], capture_output=True, text=True, timeout=280)
    assert done.returncode == 0, done.stderr
    assert "Franka Emika Panda, 1000 Hz, commanded from here" in done.stderr
    return path, done.stdout


def test_json_is_the_events_and_nothing_else(recorded: tuple[Path, str]) -> None:
    """A program reads this: one object a line, and the same events as in the recording."""
    path, printed = recorded
    lines = [json.loads(line) for line in printed.splitlines()]
    events = read_log(path)["events"]
    assert len(events) >= 3
    assert [{key: line[key] for key in ("id", "phase", "kind", "onset_s")} for line in lines] == [
        {key: event[key] for key in ("id", "phase", "kind", "onset_s")} for event in events
    ]
    assert all(line["source"] == "sim" for line in lines)


def test_monitor_says_the_same_of_the_recording(recorded: tuple[Path, str], capsys: pytest.CaptureFixture[str]) -> None:
    """What was told live is found again by `tactful monitor`, and by a replay, which has the settings from it."""
    path, printed = recorded
    live = {line["id"]: (line["kind"], line["onset_s"]) for line in map(json.loads, printed.splitlines())}
    assert main(["monitor", str(path), "--config", str(CONFIG), "--json"]) == 0
    again = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    assert [(event["kind"], event["onset_s"]) for event in again] == list(live.values())
    assert main(["live", "--source", f"replay:{path}", "--speed", "0", "--json"]) == 0
    replayed = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    without_source = [{key: value for key, value in line.items() if key != "source"} for line in replayed]
    expected = [
        {key: value for key, value in line.items() if key != "source"} for line in map(json.loads, printed.splitlines())
    ]
    told = [(line["id"], line["phase"], line["t"]) for line in without_source]
    assert told[: len(expected)] == [(line["id"], line["phase"], line["t"]) for line in expected]


@pytest.mark.skipif(os.name == "nt", reason="signals are those of POSIX")
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_signal_ends_it_in_order(number: signal.Signals, tmp_path: Path) -> None:
    """Ctrl-C and `kill` end a run: the arm is brought to rest, the recording is closed, what was found is told."""
    path = tmp_path / "run.parquet"
    words = [sys.executable, "-m", "tactful", "live", "--source", "sim", "--speed", "0.5", "--record", str(path)]
    with subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        deadline = time.monotonic() + 250
        while time.monotonic() < deadline and not (path.is_file() and path.stat().st_size > 20_000):
            time.sleep(0.05)
        process.send_signal(number)
        _, said = process.communicate(timeout=60)
    assert process.returncode == 0
    assert f"recorded {path}" in said.replace("\n", "")
    recording = Recording.read(path)
    assert recording.format == "parquet"
    assert recording.dq is not None
    assert np.abs(recording.dq[-1]).max() < 0.02


def test_degraded_run_returns_1(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A script has to learn that samples were missing without reading the text."""
    path = tmp_path / "gaps.npz"
    t = np.concatenate([np.arange(500), np.arange(600, 1000)]) * 1e-3
    n = len(t)
    channels = {"q": np.tile(PANDA.home, (n, 1)), "dq": np.zeros((n, 7)), "tau": np.zeros((n, 7))}
    Recording(t=t, channels=channels).save(path)
    assert main(["live", "--source", f"replay:{path}", "--robot", "panda", "--speed", "0"]) == 1
    assert "100 lost" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--source", "smi"], "no source is called 'smi': did you mean 'sim'? There are franka://HOST"),
        (["--source", "sim:x"], "'x' is no seed"),
        (["--source", "sim", "--robot", "ur5e"], "the arm in the cell is a panda, not ur5e"),
        (["--source", "sim", "--react", "jump"], "no reaction is called 'jump': use continue"),
        (["--source", "sim", "--duration", "0"], "--duration is 0: give a time above 0"),
        (["--source", "sim", "--speed", "-1"], "the speed is -1.0: it is a number from 0"),
        (["--source", "sim", "--record", "run.csv"], "recordings are written as .parquet, not .csv"),
        (["--source", "replay:"], "no file is named"),
        (["--source", "replay:nowhere.csv", "--robot", "panda"], "nowhere.csv: there is no such file"),
        (["--source", "replay:nowhere.csv", "--react", "stop"], "a recording takes no torques"),
        (["--source", "sim", "--config", "nowhere.toml"], "nowhere.toml: cannot be read"),
        (["--source", "sim", "--react", "nowhere.toml"], "nowhere.toml: cannot be read"),
    ],
)
def test_bad_input_is_one_line(words: list[str], message: str, capsys: pytest.CaptureFixture[str]) -> None:
    """Whatever is wrong with the command is told before anything moves."""
    assert main(["live", *words]) == 2
    (line,) = capsys.readouterr().err.strip().splitlines()
    assert message in line


@pytest.mark.parametrize(
    ("source", "package", "extra"),
    [
        ("franka://127.0.0.1", "pylibfranka", "franka"),
        ("ros2:/joint_states", "rclpy", "ros2"),
        ("ur://127.0.0.1", "rtde_receive", "ur"),
    ],
)
def test_missing_client_names_its_extra(
    source: str, package: str, extra: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Nobody needs the clients of all robots; who needs one learns what to install."""
    monkeypatch.setitem(sys.modules, package, None)
    assert main(["live", "--source", source, "--robot", "panda"]) == 2
    assert f'pip install "tactful[{extra}]"' in capsys.readouterr().err


def test_help_says_what_it_is_not(capsys: pytest.CaptureFixture[str]) -> None:
    """Reactions must never be taken for a certified safety function."""
    assert main(["live", "--help"]) == 0
    assert "not a certified safety function" in " ".join(capsys.readouterr().out.split()).replace("│", "")
