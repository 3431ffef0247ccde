"""The summary: what a recording holds, what can be done with it, where it misleads."""

import json
from pathlib import Path

import numpy as np
import pytest

from tactful.cli._app import main
from tactful.recordings import Recording, summarize
from tactful.recordings._summary import abilities
from tests.recordings._make import csv_text, motion


@pytest.mark.parametrize(
    ("names", "possible"),
    [
        ("q dq tau", "estimation detection isolation classification"),
        ("q dq tau_ext", "estimation detection isolation classification"),
        ("q tau_ext", "estimation detection isolation"),
        ("q tau", ""),
        ("wrench", "estimation detection"),
        ("wrench tau_ext", "estimation detection"),
        ("wrench q dq", "estimation detection classification"),
        ("tau_ext", "estimation"),
        ("", ""),
        ("wrench wrench_ft", "estimation detection reference"),
    ],
)
def test_abilities(names: str, possible: str) -> None:
    """What is missing is not invented: each step needs its channels, and says which are not there."""
    found = abilities(set(names.split()))
    assert [ability.step for ability in found if ability.possible] == possible.split()
    assert all(ability.how for ability in found)


def test_band_is_from_one_period_to_nyquist() -> None:
    """At 80 Hz a window of half a second holds 40 samples: 2 to 40 Hz."""
    summary = summarize(motion(rate_hz=80.0))
    assert summary.band_hz == pytest.approx((2.0, 40.0))
    assert summary.window_s == pytest.approx(0.5)
    assert summary.label_counts == {"collision": 1, "cooperation": 1}


def trap_words(recording: Recording) -> str:
    """All traps in one text."""
    return " | ".join(summarize(recording).traps)


def test_clean_motion_has_no_traps() -> None:
    """A false alarm trains users to ignore the true ones."""
    assert summarize(motion(rows=3000)).traps == ()


def test_traps() -> None:
    """Each trap springs on the fault that it is there for."""
    good = motion(rows=3000)
    t, q, dq, tau = good.t, good.channels["q"], good.channels["dq"], good.channels["tau"]
    holes = q.copy()
    holes[7] = np.nan
    late = np.vstack([np.zeros((100, 3)), dq[:-100]])
    jitter = np.cumsum(np.random.default_rng(0).uniform(0.0004, 0.0016, 3000))
    for recording, words in [
        (good.with_channels(tau=0.01 * tau), "gravity taken out"),
        (good.with_channels(q=holes), "NaN"),
        (good.with_channels(dq=late), "delayed or filtered"),
        (good.with_channels(dq=2 * dq), "units of q, dq or time disagree"),
        (good.with_channels(q=np.round(q, 3)), "too coarse"),
        (good.with_channels(q=q + 7.0), "degrees?"),
        (good.with_channels(q=np.zeros_like(q), dq=np.zeros_like(q)), "stands still"),
        (good.with_channels(tau=np.where([True, True, False], tau, 3.0)), "tau_2 never changes"),
        (good.with_channels(tau_ext=tau), "in the median"),
        (Recording(np.sort(t // 0.002 * 0.002), good.channels), ""),
        (Recording(jitter, {"tau": tau}), "steps vary"),
        (Recording(t[::-1], {"tau": tau}), "runs backward 2999 times"),
        (
            Recording(t, {name: values[np.arange(3000) // 2 * 2] for name, values in good.channels.items()}),
            "repeat the row",
        ),
        (good.between(0.0, 0.005), "too few"),
    ]:
        assert words in trap_words(recording)


@pytest.mark.parametrize("fill", [np.nan, np.inf, 1e308, 0.0])
def test_hopeless_recordings_are_summarised(fill: float) -> None:
    """`info` is what one runs on a broken file, so it may not break itself."""
    shapes = {"q": 2, "dq": 2, "tau": 2, "tau_ext": 2, "wrench": 6}
    for t in (np.arange(40.0), np.full(40, fill), np.arange(40.0)[::-1]):
        summary = summarize(Recording(t, {name: np.full((40, k), fill) for name, k in shapes.items()}))
        json.dumps(summary.to_dict(), allow_nan=False)


def test_info_prints(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """For people: the file, its channels, what can be monitored; one block a file."""
    for name in ("a.csv", "b.csv"):
        (tmp_path / name).write_text(csv_text(motion(rows=3000)))
    assert main(["info", str(tmp_path / "a.csv"), str(tmp_path / "b.csv")]) == 0
    shown = capsys.readouterr().out
    for words in ("a.csv", "b.csv", "Channels", "momentum observer", "classification", "carries 2 to 500 Hz"):
        assert words in shown


def test_info_json(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """For programs: one object a line, strictly JSON, nothing else."""
    motion().save(tmp_path / "a.npz")
    assert main(["info", str(tmp_path / "a.npz"), "--json"]) == 0
    data = json.loads(capsys.readouterr().out)
    assert data["rows"] == 200
    assert data["labels"][0]["kind"] == "collision"


def test_info_refuses_in_one_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A bad file ends in one line and 2."""
    assert main(["info", str(tmp_path / "none.csv")]) == 2
    assert capsys.readouterr().err.count("\n") == 1
