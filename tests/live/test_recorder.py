"""The recorder: what was recorded is what was monitored, also when the process was killed."""

import json
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from tactful import Monitor, MonitorConfig, Recording, TactfulError
from tactful.live import Feed, Recorder, Sample, Session, open_source, read_log


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, list[dict[str, object]], MonitorConfig]:
    """A recorded episode of the cell, and the events of its run."""
    path = tmp_path_factory.mktemp("live") / "run.parquet"
    session = Session(open_source("sim:3", speed=0))
    recorder = Recorder(path)
    session.on_feed.append(lambda feed: recorder.follow(feed, session.about()))
    session.open()
    events = [{"told_s": step.sample.t, **step.event.to_dict()} for step in session.steps(4.5) if step.event]
    recorder.close()
    assert recorder.problem is None
    assert recorder.missed == 0
    return path, events, session.monitor.config


def test_recording_gives_the_same_events(run: tuple[Path, list[dict[str, object]], MonitorConfig]) -> None:
    """What was told live can be looked into afterwards: the monitor says the same of the file, number for number."""
    path, events, config = run
    recording = Recording.read(path)
    assert recording.format == "parquet"
    assert recording.notes == ()
    monitor, again = Monitor(config=config), []
    for row in range(len(recording)):
        event = monitor.update(recording.t[row], *(recording.channels[name][row] for name in ("q", "dq", "tau")))
        if event is not None:
            again.append({"told_s": float(recording.t[row]), **event.to_dict()})
    assert len(events) > 2
    assert json.dumps(again) == json.dumps(events)


def test_recording_holds_settings_and_events(run: tuple[Path, list[dict[str, object]], MonitorConfig]) -> None:
    """A file that is found in a year has to say what was told, and by which settings."""
    path, events, config = run
    log = read_log(path)
    assert json.dumps(log["events"]) == json.dumps(events)
    assert MonitorConfig(**log["config"]) == config


def test_killed_process_loses_less_than_a_second(tmp_path: Path) -> None:
    """Power users kill -9: the file opens under its name, lacks its last second at most, and holds what was told."""
    path = tmp_path / "killed.parquet"
    code = (
        "import sys, time\n"
        "from pathlib import Path\n"
        "from tactful.live import Feed, Recorder, Sample\n"
        "recorder = Recorder(Path(sys.argv[1]))\n"
        "first = Sample(0.0, [0.0] * 7, [0.0] * 7, [0.0] * 7)\n"
        "feed = Feed(first, 1000.0)\n"
        "recorder.follow(feed, {'config': {}})\n"
        "t = 0.0\n"
        "while True:\n"
        "    t += 0.001\n"
        "    feed.put(first._replace(t=t, q=[t] * 7), None)\n"
        "    print(t, flush=True)\n"
        "    time.sleep(0.001)\n"
    )
    last = 0.0
    with subprocess.Popen([sys.executable, "-c", code, str(path)], stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        while last < 1.5:
            last = float(process.stdout.readline())
        process.send_signal(signal.SIGKILL)
        rest = process.stdout.read().split()
    last = float(rest[-2]) if len(rest) > 1 else last
    recording = Recording.read(path)
    assert recording.format == "arrow"
    assert any("not closed" in note for note in recording.notes)
    assert last - recording.t[-1] < 1.0
    np.testing.assert_array_equal(recording.channels["q"][:, 0], recording.t)
    assert read_log(path)["events"] == []


@pytest.mark.parametrize("cut", [1, 100, 5000])
def test_torn_file_is_read_up_to_the_tear(tmp_path: Path, cut: int) -> None:
    """Wherever the last write broke off, the batches before it are whole."""
    path = tmp_path / "torn.parquet"
    recorder = Recorder(path)
    feed = Feed(Sample(0.0, np.zeros(7), np.zeros(7), np.zeros(7)), 1000.0)
    recorder.follow(feed, {})
    for k in range(1500):
        feed.put(Sample(0.001 * k, np.full(7, k), np.zeros(7), np.zeros(7)), None)
        while k % 500 == 499 and path.stat().st_size < 22 * 8 * k:  # three batches at least
            time.sleep(0.01)
    whole = path.read_bytes()
    path.with_suffix(".copy").write_bytes(whole[:-cut])
    recording = Recording.read(path.with_suffix(".copy"))
    assert 400 < len(recording) <= 1500
    np.testing.assert_array_equal(recording.channels["q"][:, 3], np.arange(len(recording)))
    recorder.close()
    assert len(Recording.read(path)) == 1500


def test_run_without_samples_leaves_no_file(tmp_path: Path) -> None:
    """An empty file is not a recording."""
    recorder = Recorder(tmp_path / "none.parquet")
    recorder.close()
    assert list(tmp_path.iterdir()) == []


def test_full_disk_does_not_stop_the_loop(tmp_path: Path) -> None:
    """What cannot be written is told at the end; the arm goes on."""
    recorder = Recorder(tmp_path / "full.parquet")
    recorder._file.close()  # every write fails from now on
    feed = Feed(Sample(0.0, np.zeros(7)), 1000.0)
    recorder._file = open("/dev/full", "wb", buffering=0)  # noqa: SIM115
    recorder.follow(feed, {})
    for k in range(100):
        feed.put(Sample(0.001 * k, np.zeros(7)), None)
    recorder.close()
    assert recorder.problem is not None
    assert "No space left on device" in recorder.problem


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("run.csv", "written as .parquet, not .csv"),
        ("there.parquet", "is there already"),
        ("no/x.parquet", "cannot be"),
    ],
)
def test_bad_file_is_told(tmp_path: Path, name: str, message: str) -> None:
    """Nobody's recording is overwritten, and a wrong name is told before the arm moves."""
    (tmp_path / "there.parquet").write_bytes(b"precious")
    with pytest.raises(TactfulError, match=message):
        Recorder(tmp_path / name)
    assert (tmp_path / "there.parquet").read_bytes() == b"precious"


def test_file_that_is_no_live_recording_is_told(tmp_path: Path) -> None:
    """A recording from elsewhere has no events to read."""
    file = tmp_path / "plain.parquet"
    Recording(t=np.arange(3.0), channels={"q": np.zeros((3, 7))}).save(file)
    with pytest.raises(TactfulError, match="no recording of a live run"):
        read_log(file)
