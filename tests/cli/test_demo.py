"""The demonstration: honest, repeatable, and from its own recording the same again."""

import itertools
from pathlib import Path

import numpy as np
import pytest

from tactful.cli._app import main
from tactful.cli.demo import _paired
from tactful.detection import NoiseConfig
from tactful.monitor import ContactEvent, Monitor, MonitorConfig
from tactful.recordings import Recording
from tactful.robots import Robot
from tactful.simulation import TrueContact, collision_and_help

NOISE = NoiseConfig(velocity_rad_s=0.001, torque_nm=0.05, model_nm=0.2)


@pytest.mark.timeout(300)
def test_demo_shows_truth_and_verdict_and_says_what_is_next(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The first thing a newcomer runs: it has to end with the comparison, the files, and a next command that works."""
    monkeypatch.setenv("COLUMNS", "120")
    out = tmp_path / "a new" / "folder"
    assert main(["demo", "--out", str(out), "--seed", "0"]) == 0
    shown = capsys.readouterr().out
    for word in ("truth", "monitor", "box, panda_link7", "hand, panda_link7", "onset [s]", "ms", "stuck at"):
        assert word in shown
    assert "the peg is in the hole, without help" in shown
    files = {"demo.csv", "demo.csv.labels.json", "taught.csv", "taught.csv.labels.json", "demo.png", "monitor.toml"}
    assert {file.name for file in out.iterdir()} == files
    assert f"tactful monitor '{out / 'demo.csv'}' --config '{out / 'monitor.toml'}'" in shown
    assert main(["monitor", str(out / "demo.csv"), "--config", str(out / "monitor.toml")]) == 0


def test_demo_without_mujoco_leaves_nothing(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """What cannot run says so in one line, before it has written anything."""
    monkeypatch.setattr("tactful.cli.demo.find_spec", lambda name: None)
    assert main(["demo", "--out", str(tmp_path / "new")]) == 2
    assert capsys.readouterr().err.strip() == 'tactful: the demo needs MuJoCo: pip install "tactful[mujoco]"'
    assert not (tmp_path / "new").exists()


def test_recording_gives_the_same_contacts_as_the_live_run(tmp_path: Path) -> None:
    """What was seen while the arm ran has to be found again in its recording, number by number."""
    episode = collision_and_help(np.random.default_rng(2))
    monitor = Monitor(episode.cell.robot, MonitorConfig(noise=NOISE))
    live: dict[int, ContactEvent] = {}
    for sample in episode.run():
        event = monitor.update(*sample)
        if event is not None:
            live[event.id] = event
    episode.cell.recording().save(tmp_path / "demo.csv")
    recording = Recording.read(tmp_path / "demo.csv")
    timeline = Monitor(Robot.load("panda"), MonitorConfig(noise=NOISE)).run(recording)
    assert timeline.events == tuple(live.values())
    assert [label.kind for label in recording.labels] == ["collision", "cooperation"]


def test_collision_and_help_are_told_apart() -> None:
    """The regression of the whole chain: both contacts found, both kinds right, nothing else, and soon."""
    for seed, mode in itertools.product((0, 7, 11), ("fast", "paper")):
        episode = collision_and_help(np.random.default_rng(seed))
        for _ in episode.run():
            pass
        monitor = Monitor(episode.cell.robot, MonitorConfig(mode=mode, noise=NOISE))
        timeline = monitor.run(episode.cell.recording())
        contacts = episode.cell.contacts
        assert (
            [event.kind for event in timeline] == [contact.kind for contact in contacts] == ["collision", "cooperation"]
        )
        for event, contact, latest_s in zip(timeline, contacts, (0.03, 0.2), strict=True):
            assert 0 < event.detected_s - contact.touch_s < latest_s


def test_what_does_not_fit_is_shown_as_such(capsys: pytest.CaptureFixture[str]) -> None:
    """A demonstration that hides a miss or a false alarm is an advertisement."""
    contact = TrueContact(
        kind="collision", name="post", link=6, touch_s=2.0, visible_s=2.0, end_s=3.0, peak_force_n=9.0
    )
    other = TrueContact(
        kind="cooperation", name="hand", link=6, touch_s=2.5, visible_s=2.5, end_s=3.5, peak_force_n=9.0
    )

    def event(detected_s: float) -> ContactEvent:
        return ContactEvent(
            id=0, phase="ended", kind="collision", onset_s=detected_s, detected_s=detected_s, end_s=4.0, link=None,
            directions=("x",), force_n=(1.0, 0.0, 0.0), peak_force_n=1.0, torque_ext_nm=(), velocity_m_s=None,
            confidence=1.0, evidence=(), sigma_min=None, damped=False,
        )  # fmt: skip

    false_alarm, right, again = event(1.0), event(2.01), event(2.2)
    pairs, extra = _paired([false_alarm, right, again], [contact, other])
    assert [(truth, found) for truth, found in pairs] == [(contact, right), (other, None)]
    assert extra == [false_alarm, again]


@pytest.mark.parametrize("arguments", [["--seed", "-1"], ["--seed", "one"], ["--out", "/dev/null/x"]])
def test_bad_input_is_one_line(arguments: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    """A slip in an option ends in one line."""
    assert main(["demo", *arguments]) == 2
    assert capsys.readouterr().err.count("\n") == 1
