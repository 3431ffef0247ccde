"""What is written reads back, and what others write is read."""

import gzip
import io
import json
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from tactful.recordings import CHANNELS, Label, Recording, RecordingError
from tests.recordings._make import csv_text, motion

SUFFIXES = (".csv", ".parquet", ".npz")
quiet = settings(max_examples=25, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])


@st.composite
def recordings(draw: st.DrawFn) -> Recording:
    """Any recording that can be: every float in the channels, finite rising time."""
    rows = draw(st.integers(1, 12))
    n = draw(st.integers(1, 4))
    names = draw(st.sets(st.sampled_from(sorted(CHANNELS)), min_size=1))
    widths = {name: {"n": n, "6n": 6 * n, "6": 6}[CHANNELS[name].width] for name in names}
    floats = st.floats(width=64)
    channels = {name: draw(hnp.arrays(np.float64, (rows, width), elements=floats)) for name, width in widths.items()}
    steps = draw(hnp.arrays(np.float64, rows, elements=st.floats(1e-4, 1e4)))
    label = st.builds(Label, st.text(min_size=1).filter(str.strip), st.just(0.25), st.floats(0.25, 9.0))
    return Recording(np.cumsum(steps), channels, tuple(draw(st.lists(label, max_size=2))), notes=("kept",))


def same(a: Recording, b: Recording) -> None:
    """Equal bit for bit, NaN included."""
    assert a.t.tobytes() == b.t.tobytes()
    assert set(a.channels) == set(b.channels)
    for name, values in a.channels.items():
        np.testing.assert_array_equal(values, b.channels[name])
        np.testing.assert_array_equal(
            np.signbit(values[~np.isnan(values)]), np.signbit(b.channels[name][~np.isnan(values)])
        )
    assert a.labels == b.labels


@pytest.mark.parametrize("suffix", SUFFIXES)
@quiet
@given(recording=recordings())
def test_round_trip_is_exact(tmp_path: Path, suffix: str, recording: Recording) -> None:
    """A recording that changes when it is saved is no evidence."""
    path = tmp_path / f"run{suffix}"
    recording.save(path)
    back = Recording.read(path)
    same(recording, back)
    assert "kept" in back.notes
    assert back.source == str(path)


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_save_leaves_no_parts(tmp_path: Path, suffix: str) -> None:
    """Written all at once: beside the file and its labels nothing remains, and the old file gives way."""
    path = tmp_path / f"run{suffix}"
    motion(rows=5).save(path)
    motion(rows=50).save(path)
    assert len(Recording.read(path)) == 50
    assert {entry.name for entry in tmp_path.iterdir()} <= {path.name, path.name + ".labels.json"}


def test_save_refuses(tmp_path: Path) -> None:
    """A suffix that means nothing and a folder that is not there are the user's to mend."""
    with pytest.raises(RecordingError, match=r"use \.csv, \.npz, \.parquet"):
        motion().save(tmp_path / "run.xlsx")
    with pytest.raises(RecordingError, match="cannot be written"):
        motion().save(tmp_path / "nowhere" / "run.csv")


def test_csv_without_labels_drops_a_stale_sidecar(tmp_path: Path) -> None:
    """Labels of an older recording under the same name would be wrong labels."""
    path = tmp_path / "run.csv"
    motion().save(path)
    Recording(np.arange(3.0) / 10, {"q": np.zeros((3, 1))}).save(path)
    assert Recording.read(path).labels == ()


def test_folder_of_labels(tmp_path: Path) -> None:
    """One file of labels for many recordings, keyed by file name."""
    (tmp_path / "run.csv").write_text(csv_text(motion()))
    (tmp_path / "labels.json").write_text(json.dumps({"run.csv": [{"kind": "contact", "start_s": 0, "end_s": 1}]}))
    assert Recording.read(tmp_path / "run.csv").labels == (Label("contact", 0.0, 1.0),)


@pytest.mark.parametrize(
    "text", ["{", "[]", '{"run.csv": [{"kind": "a"}]}', '{"run.csv": 3}', '{"run.csv": [{"knd": 1}]}']
)
def test_broken_labels_are_refused(tmp_path: Path, text: str) -> None:
    """Labels that cannot be read must not become no labels."""
    (tmp_path / "run.csv").write_text(csv_text(motion()))
    (tmp_path / "labels.json").write_text(text)
    with pytest.raises(RecordingError):
        Recording.read(tmp_path / "run.csv")


def test_label_columns_become_intervals(tmp_path: Path) -> None:
    """Text names the kind, a flag has its own column; each run of rows is one interval."""
    path = tmp_path / "run.csv"
    path.write_text(
        "time,q_0,label,contact\n0,1,,0\n0.1,1,collision,1\n0.2,1,collision,1\n0.3,1,free,0\n0.4,1,cooperation,nan\n"
    )
    assert Recording.read(path).labels == (
        Label("collision", 0.1, 0.2),
        Label("cooperation", 0.4, 0.4),
        Label("contact", 0.1, 0.2),
    )


@pytest.mark.parametrize(
    ("change", "note"),
    [
        (lambda text: text, None),
        (lambda text: "\ufeff" + text, None),
        (lambda text: text.replace("\n", "\r\n"), None),
        (lambda text: text.replace(",", ";"), None),
        (lambda text: text.replace(",", "\t"), None),
        (lambda text: text.replace(",", " "), None),
        (lambda text: "# a robot\n# " + text, None),
        (lambda text: "\n\n" + text + "\n\n", None),
        (lambda text: text.replace("\n", ",\n"), None),
        (lambda text: text.replace(",", ";").replace(".", ","), "decimal commas"),
        (lambda text: text.replace(",q_0", ',"q_0"'), None),
        (lambda text: text.replace("tau_", "tau_J_").replace("dq_", "dq[").replace("time", " Time"), None),
    ],
)
def test_csv_dialects(tmp_path: Path, change: object, note: str | None) -> None:
    """The same table in the dialects that programs write."""
    recording = motion(rows=30)
    path = tmp_path / "run.csv"
    path.write_text(change(csv_text(recording)), newline="")  # type: ignore[operator]
    back = Recording.read(path)
    np.testing.assert_array_equal(back.q, recording.q)
    np.testing.assert_array_equal(back.t, recording.t)
    assert [part for part in back.notes if "read" in part] == (
        [] if note is None else ["decimal commas read as points"]
    )


def test_gzip_and_utf16(tmp_path: Path) -> None:
    """Loggers compress; some Windows programs write UTF-16."""
    recording = motion()
    (tmp_path / "run.csv.gz").write_bytes(gzip.compress(csv_text(recording).encode()))
    (tmp_path / "wide.csv").write_text(csv_text(recording), encoding="utf-16")
    for name in ("run.csv.gz", "wide.csv"):
        np.testing.assert_array_equal(Recording.read(tmp_path / name).q, recording.q)


def test_format_is_looked_up_in_the_file(tmp_path: Path) -> None:
    """A wrong suffix does not matter: the first bytes say what it is."""
    recording = motion()
    recording.save(tmp_path / "run.parquet")
    (tmp_path / "run.parquet").rename(tmp_path / "run.csv")
    assert Recording.read(tmp_path / "run.csv").format == "parquet"


def test_parquet_list_columns_and_timestamps(tmp_path: Path) -> None:
    """Other programs write a channel as a list column, and time as a timestamp."""
    recording = motion()
    stamps = pa.array((recording.t * 1e9).round().astype(np.int64)).cast(pa.timestamp("ns"))
    lists = pa.array(list(recording.channels["q"]))
    pq.write_table(
        pa.table({"time": stamps, "q": lists, "n": pa.array([None] * 200, pa.int32())}), tmp_path / "a.parquet"
    )
    back = Recording.read(tmp_path / "a.parquet")
    np.testing.assert_array_equal(back.q, recording.q)
    np.testing.assert_allclose(back.t, recording.t, atol=1e-12)
    assert "columns not read: n" in back.notes


def test_npz_of_columns_and_of_objects(tmp_path: Path) -> None:
    """Columns an array each are fine; pickled objects are never loaded, as they can run code."""
    recording = motion()
    np.savez(tmp_path / "a.npz", time=recording.t, q_0=recording.t, q_1=recording.t, scale=np.float64(3.0))
    back = Recording.read(tmp_path / "a.npz")
    assert back.n_joints == 2
    assert "scale" in back.notes[0]
    np.savez(tmp_path / "b.npz", time=recording.t, q=np.array([{}, {}], dtype=object))
    with pytest.raises(RecordingError, match="allow_pickle"):
        Recording.read(tmp_path / "b.npz")
    np.save(tmp_path / "c.npy", recording.t)
    with pytest.raises(RecordingError, match=r"np\.savez"):
        Recording.read(tmp_path / "c.npy")


def test_parquet_needs_its_extra(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Without pyarrow the error names the extra to install."""
    motion().save(tmp_path / "run.parquet")
    monkeypatch.setitem(__import__("sys").modules, "pyarrow", None)
    with pytest.raises(RecordingError, match=r"tactful\[files\]"):
        Recording.read(tmp_path / "run.parquet")


def refusal(path: Path) -> RecordingError | None:
    """Why the file is refused; None if it is read."""
    try:
        Recording.read(path)
    except RecordingError as error:
        return error
    return None


def corrupt(data: bytes, seed: int) -> bytes:
    """Cut, flip or repeat bytes."""
    rng = np.random.default_rng(seed)
    way = seed % 3
    if way == 0:
        return data[: int(rng.integers(0, len(data)))]
    changed = bytearray(data)
    if way == 1:
        for place in rng.integers(0, len(data), 1 + seed % 5):
            changed[place] = int(rng.integers(0, 256))
        return bytes(changed)
    start, end = sorted(rng.integers(0, len(data), 2).tolist())
    return bytes(changed[:start] + changed[end:])


@pytest.mark.parametrize("suffix", [*SUFFIXES, ".json", ".csv.gz"])
def test_damage_never_escapes(tmp_path: Path, suffix: str) -> None:
    """Whatever happened to a file, the answer is a recording or one line."""
    path = tmp_path / f"run{suffix}"
    recording = motion(rows=20)
    if suffix == ".json":
        path.write_text(json.dumps({"time": recording.t.tolist(), "q": recording.channels["q"].tolist()}))
    elif suffix == ".csv.gz":
        path.write_bytes(gzip.compress(csv_text(recording).encode()))
    else:
        recording.save(path)
    data = path.read_bytes()
    (tmp_path / "run.csv.labels.json").unlink(missing_ok=True)
    answers: set[object] = set()
    for seed in range(150):
        path.write_bytes(corrupt(data, seed))
        answers.add(answer := refusal(path))
        assert answer is None or ("\n" not in str(answer) and str(path) in str(answer))
    assert len(answers) > 1


@quiet
@given(data=st.binary(max_size=300))
def test_garbage_is_refused(tmp_path: Path, data: bytes) -> None:
    """Random bytes are no recording."""
    path = tmp_path / "garbage"
    path.write_bytes(data)
    with pytest.raises(RecordingError):
        Recording.read(path)


@quiet
@given(
    row=st.integers(0, 19), column=st.integers(0, 9), cell=st.sampled_from(["", "nan", "inf", "x", "1,2", '"', "1e999"])
)
def test_any_one_cell(tmp_path: Path, row: int, column: int, cell: str) -> None:
    """One odd cell anywhere: a missing number is counted, anything else names its line and column."""
    lines = csv_text(motion(rows=20)).split("\n")
    cells = lines[row + 1].split(",")
    cells[column] = cell
    lines[row + 1] = ",".join(cells)
    path = tmp_path / "run.csv"
    path.write_text("\n".join(lines))
    answer = refusal(path)
    if cell in ("x", "1,2", '"'):
        assert answer is not None
        assert answer.line == row + 2
    else:
        assert answer is None
        assert Recording.read(path).quality.nonfinite_rows == 1


def test_io_buffer_is_not_a_path() -> None:
    """A mistake in the argument is a TypeError of Python, not a strange recording."""
    with pytest.raises(TypeError):
        Recording.read(io.StringIO("time,q_0"))  # type: ignore[arg-type]
