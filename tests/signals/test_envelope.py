"""The causal envelope against its definition, window by window, and what it promises of any signal."""

import copy
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from tactful.errors import TactfulError
from tactful.signals import CausalEnvelope, _envelope

Array = NDArray[np.float64]


def by_definition(t: Array, x: Array, a: float, m_max: int) -> tuple[Array, Array]:
    """(15) and (16), each bound from whole windows, with m = min(k, m_max)."""
    lower, upper = x.copy(), x.copy()
    for k in range(1, len(x)):
        window = x[max(0, k - m_max) : k + 1]
        low, high = window.min(axis=0), window.max(axis=0)
        share = min(1.0, a * (t[k] - t[k - 1]))
        lower[k] = np.minimum(low, (1 - share) * lower[k - 1] + share * low)
        upper[k] = np.maximum(high, (1 - share) * upper[k - 1] + share * high)
    return lower, upper


def ringing(count: int = 400, axes: int = 3) -> tuple[Array, Array]:
    """A decaying oscillation with an offset and noise, at irregular times."""
    rng = np.random.default_rng(3)
    t = np.cumsum(rng.uniform(5e-4, 1.5e-3, count))
    w = 2 * np.pi * np.array([20.0, 27.0, 35.0])[:axes]
    ring = np.exp(-t[:, None] / 0.05) * np.sin(w * t[:, None])
    return t, ring + [0.1, -0.2, 0.0][:axes] + 0.01 * rng.standard_normal((count, axes))


@pytest.mark.parametrize(("a", "m_max"), [(18.0, 15), (30.0, 10), (5.0, 0), (400.0, 1), (1e6, 63), (20.0, 200)])
def test_equals_its_definition(a: float, m_max: int) -> None:
    """The ring buffer must be what the windows of the equations are, also when it wraps and when a h exceeds one."""
    t, x = ringing()
    expected = by_definition(t, x, a, m_max)
    bounds = CausalEnvelope(3, a_per_s=a, window=m_max).run(t, x)
    np.testing.assert_allclose(bounds, expected, rtol=0, atol=1e-14)


def test_encloses_the_signal_and_comes_back_to_a_constant() -> None:
    """It is an envelope: no sample lies outside, and what ceases to oscillate is enclosed ever more closely."""
    t, x = ringing()
    x[200:] = 0.3
    lower, upper = CausalEnvelope(3, a_per_s=50.0, window=15).run(t, x)
    assert (lower <= x).all()
    assert (upper >= x).all()
    assert np.all(np.diff((upper - lower)[216:], axis=0) <= 0)
    np.testing.assert_allclose(lower[-1], 0.3, atol=1e-3)


def test_closed_form_of_the_decay() -> None:
    """After a step down, the upper bound decays as (1 - a h)^k once the window has left the step."""
    t = np.arange(60) * 1e-3
    x = np.where(t < 0.0095, 1.0, 0.0)[:, None]
    _, upper = CausalEnvelope(1, a_per_s=30.0, window=5).run(t, x)
    np.testing.assert_allclose(upper[:15, 0], 1.0)
    np.testing.assert_allclose(upper[15:, 0], 0.97 ** np.arange(1, 46), rtol=1e-12)


def test_mirrors() -> None:
    """The two bounds are one rule: of the mirrored signal they change their places."""
    t, x = ringing()
    lower, upper = CausalEnvelope(3, a_per_s=18.0, window=15).run(t, x)
    mirrored = CausalEnvelope(3, a_per_s=18.0, window=15).run(t, -x)
    np.testing.assert_array_equal(mirrored, (-upper, -lower))


def test_stream_is_batch_and_reset_forgets() -> None:
    """A loop at 1 kHz and an analysis afterwards have to agree bit for bit."""
    t, x = ringing()
    envelope = CausalEnvelope(3, a_per_s=18.0, window=15)
    lower, upper = envelope.run(t, x)
    envelope.reset()
    first = [envelope.update(time, row) for time, row in zip(t[:150], x[:150], strict=True)]
    twin = copy.deepcopy(envelope)
    rest = twin.run(t[150:], x[150:])
    np.testing.assert_array_equal(np.concatenate([[row[0] for row in first], rest[0]]), lower)
    np.testing.assert_array_equal(np.concatenate([[row[1] for row in first], rest[1]]), upper)


def test_restart_begins_a_new_window() -> None:
    """After an impact, samples from before it must not count: m is 0 there, not 1."""
    record: Any = _envelope.envelope_record(1, 10.0, 5)
    envelope = record[0]
    for x in (9.0, 9.0, 0.0):
        _envelope.remember(envelope, np.array([x]))
    _envelope.restart(envelope, np.array([0.0]), 0)
    _envelope.remember(envelope, np.array([0.5]))
    _envelope.advance(envelope, 1e-3)
    assert (envelope["lower"][0], envelope["upper"][0]) == (0.0, 0.5)
    _envelope.restart(envelope, np.array([0.5]), 1)  # as printed: the next window reaches to before the restart
    _envelope.remember(envelope, np.array([0.5]))
    _envelope.advance(envelope, 1e-3)
    assert envelope["lower"][0] == 0.0


@pytest.mark.parametrize(
    ("t", "x"),
    [
        ([0.0, 0.0], [[1.0], [1.0]]),
        ([0.0], [[np.nan]]),
        ([np.inf], [[1.0]]),
        ([0.0], [[1.0, 2.0]]),
        ([0.0], [1.0]),
        ([0.0, 1.0], [[1.0]]),
    ],
)
def test_samples_that_do_not_fit(t: list[float], x: list[Any]) -> None:
    """A number that is not finite would stay in the bounds for ever."""
    with pytest.raises(TactfulError):
        CausalEnvelope(1, a_per_s=18.0, window=15).run(t, x)


@pytest.mark.parametrize("settings", [(0, 18.0, 15), (1, 0.0, 15), (1, 18.0, -1), (1, float("nan"), 1)])
def test_settings_that_make_no_sense(settings: tuple[int, float, int]) -> None:
    """They are told when the envelope is made."""
    axes, a, window = settings
    with pytest.raises(TactfulError):
        CausalEnvelope(axes, a_per_s=a, window=window)
