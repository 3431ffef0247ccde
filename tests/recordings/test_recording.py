"""Recording, Label and Quality: what they hold, what they refuse."""

import pickle
import subprocess
import sys

import numpy as np
import pytest

from tactful.errors import TactfulError
from tactful.recordings import Label, Recording, RecordingError
from tests.recordings._make import motion


def test_channels_and_properties() -> None:
    """The properties are the channels, and what is not recorded is None, not invented."""
    recording = motion()
    assert recording.q is recording.channels["q"]
    assert recording.tau_ext is None
    assert recording.wrench is None
    assert recording.n_joints == 3
    assert recording.rate_hz == pytest.approx(1000.0)
    assert recording.duration_s == pytest.approx(0.199)
    assert len(recording) == 200


def test_is_immutable() -> None:
    """A monitor that keeps a recording must be able to trust that nobody changes it."""
    recording = motion()
    with pytest.raises(ValueError, match="read-only"):
        recording.t[0] = 1.0
    with pytest.raises(TypeError):
        recording.channels["q"] = recording.t  # type: ignore[index]
    with pytest.raises(AttributeError):
        recording.t = recording.t  # type: ignore[misc]


def test_caller_keeps_a_writable_array() -> None:
    """Handing an array over must not freeze it under its owner's hands."""
    t = np.arange(5.0)
    Recording(t, {"q": np.zeros((5, 1))})
    t[0] = -1.0
    assert t[0] == -1.0


def test_arrays_are_contiguous_float64() -> None:
    """Kernels are compiled for one layout: float64, C-contiguous."""
    recording = Recording(np.arange(4), {"q": np.asfortranarray(np.ones((4, 3), dtype=np.float32))})
    assert recording.channels["q"].flags.c_contiguous
    assert recording.channels["q"].dtype == recording.t.dtype == np.float64


def test_pickle() -> None:
    """Recordings go to worker processes."""
    recording = motion()
    copy = pickle.loads(pickle.dumps(recording))
    np.testing.assert_array_equal(copy.q, recording.q)
    assert copy.labels == recording.labels


@pytest.mark.parametrize(
    ("t", "channels", "says"),
    [
        (np.zeros(0), {}, "no rows"),
        (np.zeros((3, 2)), {}, r"shape \(3, 2\)"),
        (np.arange(3.0), {"Q": np.zeros((3, 2))}, "did you mean 'q'"),
        (np.arange(3.0), {"wrenchft": np.zeros((3, 6))}, "did you mean 'wrench_ft'"),
        (np.arange(3.0), {"zzz": np.zeros((3, 6))}, "use one of q, dq"),
        (np.arange(3.0), {"q": np.zeros((4, 2))}, r"expected \(3, k\)"),
        (np.arange(3.0), {"q": np.zeros(3)}, r"expected \(3, k\)"),
        (np.arange(3.0), {"wrench": np.zeros((3, 3))}, "a wrench has 6"),
        (np.arange(3.0), {"jacobian": np.zeros((3, 10))}, "multiple of 6"),
        (np.arange(3.0), {"q": np.zeros((3, 7)), "tau": np.zeros((3, 6))}, "q 7, tau 6"),
        (np.arange(3.0), {"q": np.zeros((3, 7)), "jacobian": np.zeros((3, 36))}, "jacobian 6"),
        (["a", "b"], {}, "not an array of numbers"),
    ],
)
def test_refuses(t: object, channels: dict[str, object], says: str) -> None:
    """Every mistake ends in one line that names the channel and what is expected."""
    with pytest.raises(RecordingError, match=says) as caught:
        Recording(t, channels)  # type: ignore[arg-type]
    assert "\n" not in str(caught.value)
    assert isinstance(caught.value, TactfulError)


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (("", 0.0, 1.0), "needs a kind"),
        (("a", 2.0, 1.0), "before it begins"),
        (("a", float("nan"), 1.0), "finite"),
        (("a", 0.0, 1.0, -1), "link"),
        (("a", "0", 1.0), "start_s"),
    ],
)
def test_label_refuses(arguments: tuple[object, ...], says: str) -> None:
    """A label that ends before it begins would silently match nothing."""
    with pytest.raises(RecordingError, match=says):
        Label(*arguments)  # type: ignore[arg-type]


def test_between_cuts_rows_and_labels() -> None:
    """A part keeps its own clock, so that times still mean the same, and cuts labels to itself."""
    part = motion().between(0.007, 0.030)
    assert part.t[0] == pytest.approx(0.007)
    assert len(part) == 23
    assert [(label.kind, label.start_s, label.end_s) for label in part.labels] == [
        ("collision", 0.007, pytest.approx(0.009)),
        ("cooperation", pytest.approx(0.020), 0.030),
    ]
    with pytest.raises(RecordingError, match=r"holds 0 to 0\.199 s"):
        motion().between(5.0, 6.0)


def test_with_channels_adds_replaces_and_removes() -> None:
    """Calibration replaces a channel; an experiment takes one away."""
    recording = motion().with_channels(tau=None, tau_ext=np.zeros((200, 3)), q=np.ones((200, 3)))
    assert set(recording.channels) == {"q", "dq", "tau_ext"}
    assert recording.q is not None
    assert recording.q[0, 0] == 1.0
    with pytest.raises(RecordingError, match="unknown channel"):
        recording.with_channels(torque=np.ones((200, 3)))


def test_quality_counts_what_was_put_in() -> None:
    """Each irregularity is counted once, on a case where the counts are known."""
    t = np.array([0.0, 1.0, 2.0, 2.0, 3.0, 10.0, 9.0, 10.0, np.nan, 12.0])
    q = np.arange(10.0)[:, None].copy()
    q[4] = q[3]
    q[7] = np.inf
    quality = Recording(t, {"q": q}).quality
    assert (quality.rows, quality.repeated_rows, quality.repeated_stamps) == (10, 1, 1)
    assert (quality.backward_steps, quality.gaps, quality.longest_gap_s) == (1, 1, 7.0)
    assert quality.nonfinite_rows == 2
    assert quality.median_step_s == 1.0


def test_single_row_and_timeless_rows() -> None:
    """The smallest recordings have no rate, and say so with nan instead of failing."""
    assert np.isnan(Recording(np.zeros(1), {}).rate_hz)
    recording = Recording(np.full(3, np.nan), {"q": np.zeros((3, 1))})
    assert recording.duration_s == 0.0
    assert recording.quality.nonfinite_rows == 3


def test_import_is_light() -> None:
    """Files are an extra: reading CSV may not cost the import of pyarrow, nor of anything else heavy."""
    code = (
        "import sys, tactful.recordings\n"
        "print(*{'pyarrow', 'rich', 'pandas', 'scipy', 'numba', 'pydantic', 'cyclopts'} & set(sys.modules))"
    )
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert run.stdout.split() == []
