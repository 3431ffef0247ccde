"""Traps: units that a file does not state, and tables that are broken, are found and said, never silently wrong."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from tactful.recordings import Recording, RecordingError
from tests.recordings._make import csv_text, motion


def read(tmp_path: Path, text: str, name: str = "run.csv") -> Recording:
    """Read a text as a file."""
    path = tmp_path / name
    path.write_text(text)
    return Recording.read(path)


@pytest.mark.parametrize(("unit", "factor"), [("s", 1.0), ("ms", 1e3), ("us", 1e6), ("ns", 1e9)])
@pytest.mark.parametrize("rate_hz", [50.0, 1000.0])
@pytest.mark.parametrize("moving", [True, False])
def test_time_unit(tmp_path: Path, unit: str, factor: float, rate_hz: float, moving: bool) -> None:
    """Time in ms taken for s would make every rate and every filter wrong by a thousand."""
    recording = motion(rate_hz=rate_hz)
    if not moving:
        recording = recording.with_channels(q=None, dq=None)
    back = read(tmp_path, csv_text(recording, time_factor=factor))
    np.testing.assert_allclose(back.t, recording.t, atol=1e-12)
    assert any(f"time in {unit}" in note for note in back.notes) == (unit != "s")


@pytest.mark.parametrize("factor", [1.0, 1e3, 1e6, 1e9])
def test_unix_time(tmp_path: Path, factor: float) -> None:
    """The size of a unix time tells its unit at any rate; at 4 kHz the step in ms looks like one in s."""
    recording = motion(rate_hz=4000.0).with_channels(q=None, dq=None)
    shifted = Recording(recording.t + 1.7e9, recording.channels)
    back = read(tmp_path, csv_text(shifted, time_factor=factor))
    assert back.rate_hz == pytest.approx(4000.0, rel=1e-2)


def test_name_of_the_time_column_states_its_unit(tmp_path: Path) -> None:
    """What is stated is not judged: one sample a second may be meant."""
    slow = motion(rate_hz=1.0).with_channels(q=None, dq=None)
    assert read(tmp_path, csv_text(slow, time="time_s")).rate_hz == pytest.approx(1.0)
    assert read(tmp_path, csv_text(slow, time="t_ms")).rate_hz == pytest.approx(1000.0)


@pytest.mark.parametrize("degrees", [(), ("q",), ("dq",), ("q", "dq")])
def test_degrees(tmp_path: Path, degrees: tuple[str, ...]) -> None:
    """Degrees in q, in dq or in both: diff(q)/dt against dq tells the first two, the reach of q the last."""
    recording = motion(rows=2000)
    written = recording.with_channels(**{name: np.rad2deg(recording.channels[name]) for name in degrees})
    back = read(tmp_path, csv_text(written))
    np.testing.assert_allclose(back.channels["q"], recording.channels["q"], atol=1e-12)
    np.testing.assert_allclose(back.channels["dq"], recording.channels["dq"], atol=1e-12)
    assert any("degrees" in note for note in back.notes) == bool(degrees)


def test_degrees_without_velocity(tmp_path: Path) -> None:
    """A pose of 90 is no pose in radians."""
    recording = motion(rows=2000).with_channels(dq=None)
    back = read(tmp_path, csv_text(recording.with_channels(q=np.rad2deg(recording.channels["q"]))))
    np.testing.assert_allclose(back.channels["q"], recording.channels["q"], atol=1e-12)


def test_own_files_are_not_judged(tmp_path: Path) -> None:
    """A joint that turns on and on passes 4 pi; a file that Tactful wrote is in radians all the same."""
    t = np.arange(400) / 100
    recording = Recording(t, {"q": 20 * t[:, None], "dq": np.full((400, 1), 20.0)})
    for suffix in ("csv", "npz", "parquet"):
        recording.save(tmp_path / f"run.{suffix}")
        np.testing.assert_array_equal(Recording.read(tmp_path / f"run.{suffix}").q, recording.q)


BROKEN: list[tuple[str, str, int | None, str | int | None]] = [
    ("", "the file is empty", None, None),
    ("   \n\n", "the file is empty", None, None),
    ("time,q_0\n", "no rows", None, None),
    ("# only words\n", "comments but no rows", None, None),
    ("time,q_0,q_0\n0,1,1\n", "two columns are called 'q_0'", None, "q_0"),
    ("time,,q_0\n0,1,1\n", "column 1, counted from 0, has no name", None, 1),
    ("q_0,dq_0\n0,1\n1,1\n", "no time column", None, "time"),
    ("time,a,b\n0,1,2\n", "no column has a name that is known", None, None),
    ("time,q_0,q_2\n0,1,2\n", "'q_1' is missing", None, "q_1"),
    ("time,q_0,q_9999\n0,1,2\n", "'q_1' is missing", None, "q_1"),
    ("time,q_2,q_3\n0,1,2\n", "'q_0' is missing", None, "q_0"),
    ("time,q_0,q_1,dq_0\n0,1,2,3\n", "q 2, dq 1", None, None),
    ("time,q_0\n0,1\n0.1\n0.2,1\n", "1 cells, but there are 2 columns", 3, None),
    ("time,q_0\n0,1\n0.1,1,7\n0.2,1\n", "3 cells, but there are 2 columns", 3, None),
    ("time,q_0\n0,1\n0.1,1\n0.2,1,7\n", "3 cells, but there are 2 columns", 4, None),
    ("time,q_0\n0,1\n\n0.1,on\n0.2,1\n", "column 'q_0' holds 'on'", 4, "q_0"),
    ("time,q_0\n0,1\n0.1,\x00\n", "zero byte", 3, None),
    ("0,1,2\n1,1,2\n", "no header over the 3 columns: give a mapping", None, None),
    ('time,q_0\n0,"1\n0.1,2\n', "quoted cell does not end", 2, None),
]


@pytest.mark.parametrize(("text", "says", "line", "column"), BROKEN)
def test_broken_table(tmp_path: Path, text: str, says: str, line: int | None, column: str | int | None) -> None:
    """One line that says what, where and what to do; the fields hold the same for programs."""
    with pytest.raises(RecordingError, match=says) as caught:
        read(tmp_path, text)
    assert caught.value.path == str(tmp_path / "run.csv")
    assert (caught.value.line, caught.value.column) == (line, column)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("tail", "rows", "note"),
    [
        ("0.2,1.0\n", 3, None),
        ("0.2,1.0", 3, "may be cut"),
        ("0.2", 2, "line 4, the last one, is torn"),
        ("0.2,", 2, "line 4, the last one, is torn"),
        ("0.2,1e-", 2, "line 4, the last one, is torn"),
    ],
)
def test_killed_logger(tmp_path: Path, tail: str, rows: int, note: str | None) -> None:
    """A logger that was killed leaves a torn last line: the rest is good, and the loss is said."""
    recording = read(tmp_path, f"time,q_0\n0.0,1.0\n0.1,1.0\n{tail}")
    assert len(recording) == rows
    assert any(note in said for said in recording.notes) if note else not recording.notes


@pytest.mark.parametrize(
    ("prepare", "says"),
    [
        (lambda folder: folder, "this is a directory"),
        (lambda folder: folder / "runn.csv", "did you mean 'run.csv'"),
        (lambda folder: folder / "nowhere" / "run.csv", "nor a directory"),
        (lambda folder: folder / "zzzzzz", "no such file$"),
        (lambda folder: folder / ("x" * 300), "cannot be read|no such file"),
    ],
)
def test_wrong_path(tmp_path: Path, prepare: Callable[[Path], Path], says: str) -> None:
    """The most frequent mistake is a wrong name; the nearest one is suggested."""
    (tmp_path / "run.csv").write_text("time,q_0\n0,1\n")
    with pytest.raises(RecordingError, match=says):
        Recording.read(prepare(tmp_path))


def test_columns_that_are_not_read_are_said(tmp_path: Path) -> None:
    """A column under a name that nobody knows is not dropped in silence."""
    assert read(tmp_path, "time,q_0,temperature,mode\n0,1,30,auto\n0.1,1,30,auto\n").notes == (
        "columns not read: temperature, mode",
    )


def test_one_based_joints_and_wrench_spellings(tmp_path: Path) -> None:
    """Joints counted from 1 and the usual names of a wrench are understood, and the count is said."""
    names = "time,q_1,q_2,fx,fy,fz,mx,my,mz,ft_force_x,ft_force_y,ft_force_z"
    recording = read(tmp_path, f"{names}\n0,1,2,3,4,5,6,7,8,9,10,11\n")
    assert recording.n_joints == 2
    assert recording.wrench is not None
    np.testing.assert_array_equal(recording.wrench, [[3, 4, 5, 6, 7, 8]])
    np.testing.assert_array_equal(recording.channels["wrench_ft"], [[9, 10, 11, 0, 0, 0]])
    assert any("q_1 is taken for the first joint" in note for note in recording.notes)
    assert any("torques stand as 0" in note for note in recording.notes)


def test_libfranka_names_carry_its_sign(tmp_path: Path) -> None:
    """What libfranka counts is what the robot exerts; taken as it stands, every contact would point the wrong way."""
    recording = read(tmp_path, "time,tau_ext_hat_filtered_0,tau_ext_hat_filtered_1\n0,1,-2\n")
    np.testing.assert_array_equal(recording.channels["tau_ext"], [[-1, 2]])
    assert any("sign is turned" in note for note in recording.notes)
