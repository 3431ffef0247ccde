"""The sliding DFT against numpy's FFT of every window, and what it does over long time and with bad samples."""

import copy
import math
import pickle
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from tactful.errors import TactfulError
from tactful.signals import BandError, SlidingDFT, _sliding_dft, bins_in_band, largest_band_hz

Array = NDArray[np.float64]


def by_fft(x: Array, band_hz: tuple[float, float], rate_hz: float, window: int, p: float) -> Array:
    """The levels (n, axes) from the FFT of every window, with zeros before the first sample."""
    padded = np.concatenate([np.zeros((window - 1, x.shape[1])), x])
    windows = np.lib.stride_tricks.sliding_window_view(padded, window, axis=0)  # (n, axes, window)
    frequency = np.fft.rfftfreq(window, 1 / rate_hz)
    slack = 1e-9 * rate_hz
    inside = (frequency >= band_hz[0] - slack) & (frequency <= band_hz[1] + slack)
    amplitude = 2 / window * np.abs(np.fft.rfft(windows, axis=2)[:, :, inside])
    return np.asarray(np.linalg.norm(amplitude, p, axis=2))


@pytest.mark.parametrize(
    ("window", "rate_hz", "band_hz"),
    [
        (500, 1000.0, (10.0, 100.0)),
        (499, 1000.0, (10.0, 100.0)),
        (97, 125.0, (3.0, 62.5)),
        (64, 500.0, (500 / 64, 250.0)),
        (3, 100.0, (33.4, 50.0)),
        (2, 100.0, (50.0, 50.0)),
    ],
)
@pytest.mark.parametrize("norm", ["inf", 1.0, 2.0, 3.5])
def test_every_window_agrees_with_the_fft(
    window: int, rate_hz: float, band_hz: tuple[float, float], norm: float
) -> None:
    """The recursion is an identity: it has to give the FFT of each window, for even, odd, prime and tiny sizes."""
    if window == 3:
        band_hz = (100 / 3, 50.0)
    x = np.random.default_rng(window).standard_normal((3 * window + 7, 3)) * [1.0, 30.0, 0.01]
    dft = SlidingDFT(3, band_hz=band_hz, rate_hz=rate_hz, window=window, norm=norm)  # type: ignore[arg-type]
    expected = by_fft(x, band_hz, rate_hz, window, math.inf if norm == "inf" else norm)
    np.testing.assert_allclose(dft.run(x), expected, rtol=1e-10, atol=1e-13)


@pytest.mark.parametrize("norm", [200.0, 1e4])
def test_large_p_approaches_the_largest_amplitude(norm: float) -> None:
    """A small amplitude to a large power underflows, which once made the level zero."""
    x = 1e-3 * np.random.default_rng(0).standard_normal((100, 3))
    small, largest = (
        SlidingDFT(3, band_hz=(1, 50), rate_hz=100, window=100, norm=p).run(x)[-1]  # type: ignore[arg-type]
        for p in (norm, "inf")
    )
    assert np.all(largest > 0)
    assert np.all((largest <= small) & (small <= largest * 50 ** (1 / norm) * (1 + 1e-12)))


def test_sine_on_a_bin_has_its_amplitude_as_level() -> None:
    """The unit of the level is that of the signal: a threshold in newtons means newtons."""
    t = np.arange(2000) / 1000
    x = np.stack([3 * np.sin(2 * np.pi * 20 * t + 0.3), 0.5 * np.cos(2 * np.pi * 98 * t), np.sin(2 * np.pi * 8 * t)], 1)
    dft = SlidingDFT(3, band_hz=(10, 100), rate_hz=1000, window=500)
    np.testing.assert_allclose(dft.run(x)[499:], np.broadcast_to([3.0, 0.5, 0.0], (1501, 3)), atol=1e-12)
    np.testing.assert_allclose(dft.frequencies_hz, np.arange(10, 101, 2))


def test_constant_shift_has_no_effect() -> None:
    """A payload or a bias of 1 kN must not look like contact: with a rectangular window no bin but k = 0 sees it."""
    x = np.random.default_rng(1).standard_normal((1200, 3))
    plain, shifted = (SlidingDFT(3, band_hz=(10, 100), rate_hz=1000, window=250) for _ in range(2))
    np.testing.assert_allclose(shifted.run(x + 1000.0)[249:], plain.run(x)[249:], atol=1e-11)


def test_ten_million_samples_do_not_drift() -> None:
    """At 1 kHz these are three hours; the plain recursion with its pole at one would have drifted."""
    rng = np.random.default_rng(2)
    dft = SlidingDFT(3, band_hz=(10, 20), rate_hz=1000, window=500)
    block = 1000.0 + rng.standard_normal((1_000_000, 3))
    for _ in range(10):
        level = dft.run(block)
    expected = by_fft(block[-1000:], (10, 20), 1000, 500, math.inf)[500:]
    np.testing.assert_allclose(level[-500:], expected, rtol=0, atol=1e-12)


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("norm", ["inf", 2.0])
@pytest.mark.parametrize("at", [0, 1, 17, 49])
def test_bad_sample_shows_and_leaves_after_two_windows(bad: float, norm: float, at: int) -> None:
    """A NaN must neither hide behind a finite level nor stay for ever."""
    window = 50
    x = np.random.default_rng(3).standard_normal((6 * window, 3))
    spoilt = x.copy()
    spoilt[2 * window + at, 0] = bad
    clean, level = (
        SlidingDFT(3, band_hz=(10, 100), rate_hz=500, window=window, norm=norm).run(s)  # type: ignore[arg-type]
        for s in (x, spoilt)
    )
    n = 2 * window + at
    assert not np.isfinite(level[n : n + window, 0]).any()
    np.testing.assert_allclose(level[n + 2 * window :, 0], clean[n + 2 * window :, 0], atol=1e-14)
    assert np.array_equal(level[:n], clean[:n])
    assert np.array_equal(level[:, 1:], clean[:, 1:]), "the other axes have nothing to do with it"


@given(
    window=st.integers(2, 60),
    cuts=st.lists(st.integers(0, 150), max_size=5),
    p=st.sampled_from(["inf", 1.0, 2.0]),
)
@settings(max_examples=40, deadline=None)
def test_stream_is_batch_bit_for_bit(window: int, cuts: list[int], p: Any) -> None:
    """A recording judged offline must give what the robot would have seen online."""
    x = np.random.default_rng(window).standard_normal((150, 3))
    batch, stream, pieces = (
        SlidingDFT(3, band_hz=(1000 / window, 500), rate_hz=1000, window=window, norm=p) for _ in range(3)
    )
    expected = batch.run(x)
    assert np.array_equal(np.array([stream.update(row) for row in x]), expected)
    parts = np.split(x, sorted(cuts))
    assert np.array_equal(np.concatenate([pieces.run(part) for part in parts]), expected)


def test_full_after_one_window_and_reset_forgets() -> None:
    """Before the window is full the level is that of a signal that begins with a step: a monitor has to wait."""
    x = np.random.default_rng(4).standard_normal((130, 3))
    dft = SlidingDFT(3, band_hz=(10, 50), rate_hz=100, window=40)
    dft.run(x[:39])
    assert not dft.full
    dft.update(x[39])
    assert dft.full
    dft.run(x)
    dft.reset()
    assert not dft.full
    assert np.array_equal(dft.run(x), SlidingDFT(3, band_hz=(10, 50), rate_hz=100, window=40).run(x))


def test_copies_and_pickles_go_on_where_they_are() -> None:
    """A running monitor can be stored and resumed; the copy must not write into the original."""
    x = np.random.default_rng(6).standard_normal((200, 3))
    dft = SlidingDFT(3, band_hz=(10, 50), rate_hz=100, window=40)
    dft.run(x[:70])
    twins = [pickle.loads(pickle.dumps(dft)), copy.deepcopy(dft)]
    expected = dft.run(x[70:])
    for twin in twins:
        assert np.array_equal(twin.run(x[70:]), expected)


def test_any_input_array_runs_the_one_compiled_kernel() -> None:
    """Numba compiles anew for read-only or strided arrays: seconds in the middle of a control loop."""
    dft = SlidingDFT(3, band_hz=(10, 50), rate_hz=100, window=40)
    x = np.random.default_rng(7).standard_normal((60, 6))
    dft.run(np.ascontiguousarray(x[:, :3]))
    compiled = len(_sliding_dft._run.signatures)
    frozen = x[:, :3].copy()
    frozen.flags.writeable = False
    for odd in (frozen, x[:, ::2], x[:, :3].astype(np.float32), np.asfortranarray(x[:, :3]), x[:, :3].tolist()):
        dft.run(odd)
    assert len(_sliding_dft._run.signatures) == compiled


@given(
    window=st.integers(2, 2000),
    rate_hz=st.floats(1.0, 20_000.0),
    low=st.floats(0.01, 12_000.0),
    width=st.floats(0.0, 12_000.0),
)
@settings(deadline=None)
def test_band_is_carried_whole_or_refused(window: int, rate_hz: float, low: float, width: float) -> None:
    """For any rate and window: no bin inside the band is left out, none outside is taken, and no band is cut short."""
    high = low + width
    lowest, highest = largest_band_hz(rate_hz, window)
    frequency = np.arange(1, window // 2 + 1) * rate_hz / window
    for edge in (low, high):
        assume(np.abs(frequency - edge).min() > 1e-8 * rate_hz)  # on a bin, rounding decides
        assume(min(abs(edge - lowest), abs(edge - highest)) > 1e-8 * rate_hz)
    expected = 1 + np.flatnonzero((frequency >= low) & (frequency <= high))
    if lowest <= low and high <= highest and len(expected):
        assert np.array_equal(bins_in_band((low, high), rate_hz, window), expected)
    else:
        with pytest.raises(BandError):
            bins_in_band((low, high), rate_hz, window)


@pytest.mark.parametrize(("rate_hz", "window"), [(1000.0, 500), (125.0, 63), (100 / 3, 10), (997.0, 499)])
def test_largest_band_is_carried_whole(rate_hz: float, window: int) -> None:
    """The band that the error recommends has to be accepted, in spite of rounding at its ends."""
    assert list(bins_in_band(largest_band_hz(rate_hz, window), rate_hz, window)) == list(range(1, window // 2 + 1))


@pytest.mark.parametrize(
    "band_hz", [(10.0, 600.0), (0.5, 100.0), (100.0, 10.0), (-5.0, 50.0), (math.nan, 50.0), (10.1, 10.2), (0.0, 0.0)]
)
def test_band_error_names_the_largest_band(band_hz: tuple[float, float]) -> None:
    """A rate that cannot carry the band is refused with what can be had, in one line."""
    with pytest.raises(BandError, match="carries at most 2-500 Hz in steps of 2 Hz") as caught:
        SlidingDFT(1, band_hz=band_hz, rate_hz=1000.0, window=500)
    assert caught.value.largest_hz == (2.0, 500.0)
    assert (caught.value.rate_hz, caught.value.window) == (1000.0, 500)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    "wrong",
    [
        {"window": 0},
        {"window": 1},
        {"rate_hz": 0.0},
        {"rate_hz": math.nan},
        {"norm": 0.5},
        {"norm": math.nan},
        {"axes": 0},
    ],
)
def test_settings_without_sense_are_refused(wrong: dict[str, Any]) -> None:
    """They would end in a division by zero or a level without a meaning."""
    settings = {"axes": 1, "band_hz": (10, 50), "rate_hz": 100.0, "window": 40} | wrong
    with pytest.raises(TactfulError) as caught:
        SlidingDFT(settings.pop("axes"), **settings)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("shape", [(5, 2), (5, 4), (5,), (5, 3, 1), ()])
def test_samples_of_another_width_are_refused(shape: tuple[int, ...]) -> None:
    """One number for three axes would be spread over all of them without a word."""
    dft = SlidingDFT(3, band_hz=(10, 50), rate_hz=100, window=40)
    with pytest.raises(TactfulError, match="3 axes"):
        dft.run(np.zeros(shape))
    with pytest.raises(TactfulError, match="3 axes"):
        dft.update([1.0])
