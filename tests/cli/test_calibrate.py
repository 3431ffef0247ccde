"""The verb that calibrates."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tactful import Monitor, MonitorConfig, Recording
from tactful.calibration import calibrate
from tactful.cli._app import main
from tactful.evaluation import evaluate, labels_from_wrench
from tests._counterparts import require_shared_data


@pytest.mark.parametrize(
    ("words", "text"),
    [
        (["ur_pushes/no_torque.csv", "--robot", "panda"], "has 6 joints, but panda has 7"),
        (["ur_pushes/no_torque.csv", "--robot", "ur5e"], "the torque is not that of ur5e"),
        (["panda_free_motion/exciting_first_10s.csv", "--robot", "iiwa14"], "the torque is not that of iiwa14"),
        (["ur_pushes/ur_static_first_half.csv", "--robot", "ur10e"], "the arm stands still"),
        (["ur_pushes/no_torque.csv"], "which arm was recorded?"),
        (["panda_tactile_pad/data_pos_1.csv"], "something touches the arm from 2.59 to 9.75 s (by wrench)"),
    ],
)
def test_bad_input_is_one_line(words: list[str], text: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Whoever calibrates from the wrong file has to be told, and gets no configuration."""
    output = tmp_path / "monitor.toml"
    code = main(["calibrate", str(require_shared_data() / words[0]), *words[1:], "-o", str(output)])
    said = capsys.readouterr().err.strip().splitlines()
    assert code == 2
    assert text in said[-1]
    assert not output.exists()


def test_folder_of_the_output_has_to_be_there(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Nobody wants to hear it after a minute of work."""
    assert main(["calibrate", "motion.csv", "--robot", "panda", "-o", str(tmp_path / "no" / "monitor.toml")]) == 2
    assert "there is no folder" in capsys.readouterr().err


def test_motor_currents_are_calibrated_and_monitored(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """An arm without torque sensors, at 100 Hz: the friction of its gears is in the torque."""
    data, output = require_shared_data() / "ur_pushes", tmp_path / "monitor.toml"
    assert main(["calibrate", str(data / "no_torque.csv"), "--robot", "ur10e", "-o", str(output)]) == 0
    said = capsys.readouterr().out
    assert "is not supported by" in said
    assert "shoulder_pan_joint moves at up to 1.06 rad/s" in " ".join(said.split())
    assert main(["monitor", "--config", str(output), "--json", str(data / "no_torque.csv")]) == 0
    assert capsys.readouterr().out == ""
    assert main(["monitor", "--config", str(output), "--json", str(data / "ur_static_first_half.csv")]) == 0
    assert len(capsys.readouterr().out.splitlines()) == 2


def test_a_part_of_free_motion_is_enough_for_the_rest(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The first half has not seen the abrupt stop at the end of the second; both pushes are found all the same."""
    data = require_shared_data() / "ur_pushes"
    whole = Recording.read(data / "no_torque.csv")
    first_s, half_s = float(whole.t[0]), whole.duration_s / 2
    for name, part in (("a", whole.between(first_s, first_s + half_s)), ("b", whole.between(first_s + half_s, np.inf))):
        part.save(tmp_path / f"{name}.csv")
        output = str(tmp_path / f"{name}.toml")
        assert main(["calibrate", str(tmp_path / f"{name}.csv"), "--robot", "ur10e", "-o", output]) == 0
        capsys.readouterr()
        assert main(["monitor", "--config", output, "--json", str(data / "no_torque.csv")]) == 0
        assert capsys.readouterr().out == ""
        assert main(["monitor", "--config", output, "--json", str(data / "ur_static_first_half.csv")]) == 0
        assert len(capsys.readouterr().out.splitlines()) == 2


def test_a_pad_is_calibrated_by_the_seconds_before_the_press(tmp_path: Path) -> None:
    """A wrench at 80 Hz is all that some arms give; no press is missed, and none invented."""
    data = require_shared_data() / "panda_tactile_pad"
    recordings = [Recording.read(data / f"data_pos_{number}.csv") for number in (1, 2, 3, 4)]
    before = []
    for recording in recordings:
        (press,) = labels_from_wrench(recording)
        before.append(recording.between(float(recording.t[0]), press.start_s - 0.2))
    found = calibrate(before, MonitorConfig(source="wrench"))
    for recording in recordings:
        labelled = replace(recording, labels=labels_from_wrench(recording))
        outcome = evaluate(labelled, Monitor(config=found.config).run(labelled))
        assert outcome.found == 1
        assert not outcome.false_alarms
