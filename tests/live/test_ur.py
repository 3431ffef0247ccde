"""The real ur-rtde client against a small RTDE server on loopback."""

from __future__ import annotations

import importlib.util
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest

from tactful import MonitorConfig, Recording
from tactful.cli._app import main
from tactful.live import Recorder, Session, SourceError, open_source
from tests._counterparts import missing
from tests.live import _served
from tests.live._scenes import Scene
from tests.live._served import Served, serve

pytestmark = [pytest.mark.live, pytest.mark.timeout(300)]

CONFIG = MonitorConfig(robot={"model": "ur5e"}, noise={"velocity_rad_s": 0.001, "torque_nm": 0.05, "model_nm": 0.5})


@pytest.fixture(autouse=True)
def _client() -> None:
    if importlib.util.find_spec("rtde_receive") is None:
        missing("ur-rtde is not installed")


@contextmanager
def running(scene: Scene) -> Iterator[tuple[Served, Session]]:
    """Serve an arm and connect to it; from then on a packet comes when it is granted, as one is at the end."""
    with serve("_rtde_server", scene) as arm:
        session = Session(open_source(f"ur://{arm.host}", CONFIG), reconnect_s=1.0)
        session.open()
        last = arm.get_in_step()["in_step"]
        while session.source.read().t < last:
            pass
        arm.grant()
        yield arm, session


def test_a_minute_of_packets_is_processed() -> None:
    """60 s of the robot's time at 500 Hz: every packet once through the monitor, none skipped, none twice."""
    with running(Scene()) as (arm, session):
        assert session.source.rate_hz == 500.0
        stamps = []
        for step in session.steps(60.0):
            stamps.append(step.sample.t)
            arm.grant()
        report = session.report
    assert report.samples == report.health.samples == len(stamps) == 30_001
    np.testing.assert_allclose(np.diff(stamps), 0.002, atol=1e-9)
    assert (report.lost, report.contacts, report.degraded) == (0, 0, False)


def test_push_is_told_in_its_sample(tmp_path: Path) -> None:
    """A hand: torques by the motors' currents, the event with the packet in which the detector fires."""
    path = tmp_path / "push.parquet"
    with running(Scene(hand_s=2.0)) as (arm, session):
        recorder = Recorder(path)
        session.on_feed.append(lambda feed: recorder.follow(feed, {}))
        told = []
        for step in session.steps(3.5):
            arm.grant()
            if step.event is not None:
                told.append((step.sample.t, step.event))
        recorder.close()
    assert told
    t, first = told[0]
    assert (first.phase, first.detected_s) == ("began", t)
    assert arm.truth is not None
    assert arm.truth["touch_s"] < t < arm.truth["touch_s"] + 0.2
    assert len(Recording.read(path)) == session.report.samples


def test_lost_controller_ends_the_run(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The controller is switched off: one line, exit code 1, the recording kept."""
    path = tmp_path / "cut.parquet"
    with serve("_rtde_server", Scene()) as arm:
        arm.switch_off_once_recorded(path, 300 * 19 * 8)  # of which the settings are a part
        words = ["live", "--source", f"ur://{arm.host}", "--robot", "ur5e", "--record", str(path)]
        assert main(words) == 1
    said = capsys.readouterr().err
    (line,) = [line for line in said.splitlines() if "before its time" in line]
    assert "the controller has stopped sending" in line
    assert len(Recording.read(path)) >= 100


def test_nobody_there_is_told_in_one_line(capsys: pytest.CaptureFixture[str]) -> None:
    """A wrong address is the commonest mistake."""
    host = _served.address()
    assert main(["live", "--source", f"ur://{host}", "--robot", "ur5e"]) == 2
    assert capsys.readouterr().err.strip() == (
        f"tactful: ur://{host}: no arm at {host}, port 30004: Connection refused; check the address"
    )


@pytest.mark.parametrize(
    ("address", "model", "message"),
    [
        ("ur://127.0.0.1", None, "which arm is it"),
        ("ur://127.0.0.1", "panda", "gives 6 joints, but panda has 7"),
        ("ur://127.0.0.1?nm_a=1,2", "ur5e", "give six numbers"),
        ("ur://127.0.0.1?gain=1", "ur5e", "unknown option 'gain'"),
        ("ur://", "ur5e", "no arm is named"),
    ],
)
def test_bad_address_is_told(address: str, model: str | None, message: str) -> None:
    """What is wrong with an address is told before anything is connected."""
    with pytest.raises(SourceError, match=message):
        open_source(address, MonitorConfig(robot={"model": model}))
