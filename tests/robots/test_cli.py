"""The verb `tactful robots`."""

import json

from tactful.cli.robots import robots
from tactful.robots import Robot


def test_json_is_one_object_a_line(capsys):
    """Scripts read it: nothing else may be on stdout, and every line has the facts that choose a robot."""
    robots(json=True)
    lines = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    assert [line["name"] for line in lines] == list(Robot.names())
    for line in lines:
        assert set(line) == {
            "name", "title", "joints", "mass_kg", "reach_m", "frames", "tip", "torque_sensor", "source"
        }  # fmt: skip
        assert line["tip"] in line["frames"]


def test_table_names_every_robot_its_frames_and_source(capsys, monkeypatch):
    """The table says what the JSON says, and cuts nothing off on a narrow terminal."""
    monkeypatch.setenv("COLUMNS", "80")
    robots()
    assert "…" not in capsys.readouterr().out
    monkeypatch.setenv("COLUMNS", "140")
    robots()
    text = capsys.readouterr().out
    for name in Robot.names():
        robot = Robot.load(name)
        assert name in text
        assert all(word in text for word in robot.source.split())
        assert all(frame in text for frame in robot.frames)
