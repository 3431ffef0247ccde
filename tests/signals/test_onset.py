"""The backward search for the beginning of a rise, against cases whose onset is known and against a plain loop."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from tactful.errors import TactfulError
from tactful.signals import onset_index

finite = st.floats(-1e6, 1e6)


def by_loop(x: NDArray[np.float64], fraction: float) -> int:
    """The definition, one sample at a time."""
    before = float(np.median(x[: max(1, len(x) // 3)]))
    peak = 0
    for i in range(len(x)):
        if abs(x[i] - before) > abs(x[peak] - before):
            peak = i
    height = x[peak] - before
    for i in range(peak, -1, -1):
        if (x[i] - before) * np.sign(height) <= fraction * abs(height):
            return i
    return 0


@given(st.lists(finite, min_size=1, max_size=60), st.floats(0.01, 0.99))
def test_agrees_with_a_plain_loop(values: list[float], fraction: float) -> None:
    """The vector form has to be the backward search, for any signal."""
    x = np.array(values)
    assert onset_index(x, fraction=fraction) == by_loop(x, fraction)


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("level", [0.0, -7.5])
def test_step_begins_at_its_last_sample_at_rest(sign: int, level: float) -> None:
    """The force of a hard collision is a step, along either sense of an axis and from any load."""
    x = level + sign * 12.0 * (np.arange(200) > 140)
    assert onset_index(x) == 140


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("fraction", [0.05, 0.15, 0.5])
def test_ramp_crosses_the_fraction_of_its_height(sign: int, fraction: float) -> None:
    """A push grows slowly: the onset lies where the ramp has the fraction of its height, by definition."""
    x = sign * np.clip(np.arange(301) - 200, 0, None) / 100.0
    assert onset_index(x, fraction=fraction) == 200 + int(fraction * 100 + 1e-9)


def test_impulse_that_has_passed() -> None:
    """By the time of detection the force of an impact may be gone: the search starts at the peak, not at the end."""
    x = np.zeros(300)
    x[180:184] = [2.0, 9.0, 8.0, 1.0]
    assert onset_index(x) == 179
    assert onset_index(-x) == 179


def test_last_of_two_rises_counts() -> None:
    """A former, smaller touch in the same second is not where this contact began."""
    x = np.zeros(400)
    x[150:180] = 5.0
    x[330:] = 10.0
    assert onset_index(x) == 329


def test_touch_in_the_first_third_does_not_move_the_level_before() -> None:
    """The level before is a median: a blow that lasts less than half of the first third does not count as rest."""
    x = np.zeros(300)
    x[20:50] = 40.0
    x[250:] = 50.0
    assert onset_index(x) == 249


def test_noise_moves_the_onset_by_a_few_samples_only() -> None:
    """Noise of a tenth of the rise must not lead the search far away."""
    rng = np.random.default_rng(5)
    clean = np.where(np.arange(500) > 400, 5.0, 0.0)
    found = [onset_index(clean + 0.2 * rng.standard_normal(500)) for _ in range(200)]
    assert set(found) == {400}
    ramp = np.clip(np.arange(500) - 400, 0, None) / 20.0
    found = [onset_index(ramp + 0.1 * rng.standard_normal(500)) for _ in range(200)]
    assert max(abs(np.array(found) - onset_index(ramp))) <= 8


@pytest.mark.parametrize(
    ("values", "expected"),
    [([3.0], 0), ([0.0, 1.0], 0), ([1.0, 0.0], 0), ([2.0, 2.0], 0), ([0.0, 0.0, 1.0], 1), ([1.0] * 50, 0)],
)
def test_short_and_constant_signals(values: list[float], expected: int) -> None:
    """A contact right after the start leaves one or two samples, and a constant has no rise."""
    assert onset_index(values) == expected


@pytest.mark.parametrize("values", [[], [1.0, np.nan, 3.0], [0.0, np.inf], [[1.0, 2.0]], 1.0])
def test_what_is_no_signal_is_refused(values: object) -> None:
    """An index from a NaN would be an onset time that nobody can tell from a true one."""
    with pytest.raises(TactfulError, match="row of at least one number"):
        onset_index(values)  # type: ignore[arg-type]
