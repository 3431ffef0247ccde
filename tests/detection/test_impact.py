"""The impact detector against its conditions, written down sample by sample, and against scipy's filter."""

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import signal

from tactful.config import ConfigError
from tactful.detection import ImpactConfig, ImpactDetector
from tactful.errors import TactfulError

Array = NDArray[np.float64]


def by_definition(t: Array, r: Array, r_b: Array) -> Array:
    """(8) and (9) by loops: indices of impacts."""
    rate = np.zeros_like(r)
    found = []
    for k in range(1, len(t)):
        for i in range(r.shape[1]):
            rate[k, i] = (r[k, i] - r[k - 1, i]) / (t[k] - t[k - 1])
        if k > 1 and any(abs(rate[k, i]) >= r_b[i] and abs(rate[k - 1, i]) < r_b[i] for i in range(r.shape[1])):
            found.append(k)
    return np.array(found)


def struck(count: int = 500) -> tuple[Array, Array]:
    """A residual of two joints with noise, struck now and then, at irregular times."""
    rng = np.random.default_rng(1)
    t = np.cumsum(rng.uniform(5e-4, 1.5e-3, count))
    r = np.cumsum(rng.standard_normal((count, 2)) * (rng.random((count, 1)) < 0.1), axis=0)
    return t, r + 0.05 * rng.standard_normal((count, 2))


@pytest.mark.parametrize("r_b", [(300.0, 300.0), (500.0, np.inf), (np.inf, np.inf), (100.0, 1500.0)])
def test_equals_its_conditions(r_b: tuple[float, float]) -> None:
    """One joint suffices, and a joint with an infinite bound never does."""
    t, r = struck()
    detector = ImpactDetector(2, ImpactConfig(r_b_nm_s=r_b, refractory_s=0))
    np.testing.assert_array_equal(np.flatnonzero(detector.run(t, r)), by_definition(t, r, np.array(r_b)))


def test_tells_an_impact_from_within_a_contact() -> None:
    """A threshold on r itself could not: the second blow comes while the first still presses."""
    t = np.arange(100) * 1e-3
    r = np.where(t >= 0.02, 30.0, 0.0) + np.where(t >= 0.06, 5.0, 0.0)
    assert np.flatnonzero(ImpactDetector(1).run(t, r[:, None])).tolist() == [20, 60]


def test_two_blows_in_one_excursion_are_one() -> None:
    """That is what (9) says, and a limit of it: the rate has to fall below r_b in between."""
    t = np.arange(10) * 1e-3
    r = np.array([0, 0, 0, 10, 20, 30, 30, 30, 30, 30.0])
    assert np.flatnonzero(ImpactDetector(1).run(t, r[:, None])).tolist() == [3]


@pytest.mark.parametrize(
    ("refractory_s", "expected"), [(0.0, [10, 12, 19, 21]), (0.009, [10, 19]), (0.0091, [10, 21]), (0.1, [10])]
)
def test_refractory_time(refractory_s: float, expected: list[int]) -> None:
    """It counts from the impact that was told, not from those it hides, and ends exactly after its length."""
    t = np.arange(40) * 1e-3
    blows = np.isin(np.arange(40), [10, 12, 19, 21])
    detector = ImpactDetector(1, ImpactConfig(refractory_s=refractory_s))
    assert np.flatnonzero(detector.run(t, 5.0 * np.cumsum(blows)[:, None])).tolist() == expected


def test_bandpass_is_a_high_pass_of_the_residual() -> None:
    """With w s / (s + w) by the implicit rule: scipy's filter of the differences, and r_b keeps its meaning."""
    t = np.arange(300) * 1e-3
    r = np.random.default_rng(0).standard_normal((300, 1))
    detector = ImpactDetector(1, ImpactConfig(bandpass_hz=40.0, r_b_nm_s=1e9))
    w = 2 * np.pi * 40.0 * 1e-3
    expected = signal.lfilter([w / (1 + w) / 1e-3], [1, -1 / (1 + w)], np.diff(r[:, 0]))
    impacts, rates = detector.trace(t, r)
    assert not impacts.any()
    np.testing.assert_allclose(rates[1:, 0], expected, rtol=1e-10, atol=1e-9)
    assert detector.rate == rates[-1]
    slow = ImpactDetector(1, ImpactConfig(bandpass_hz=40.0))
    slow.run(t, 100.0 * t[:, None])
    assert slow.rate[0] == pytest.approx(100.0)


def test_bandpass_hears_less_noise() -> None:
    """That is what it is for: white noise on r that impacts for the difference does not for the band-pass."""
    t = np.arange(2000) * 1e-3
    r = 1.5 * np.random.default_rng(0).standard_normal((2000, 1))
    r[1000:] += 40.0
    assert ImpactDetector(1).run(t, r).sum() > 20
    assert np.flatnonzero(ImpactDetector(1, ImpactConfig(bandpass_hz=40.0)).run(t, r)).tolist() == [1000]


def test_stream_is_batch_and_reset_forgets() -> None:
    """A loop at 1 kHz and an analysis afterwards have to agree, and a reset leaves nothing behind."""
    t, r = struck()
    detector = ImpactDetector(2, ImpactConfig(r_b_nm_s=300.0, bandpass_hz=100.0))
    batch = detector.run(t, r)
    assert batch.any()
    detector.reset()
    assert [detector.update(time, row) for time, row in zip(t, r, strict=True)] == batch.tolist()


def test_bad_input() -> None:
    """Each mistake is told in one line."""
    with pytest.raises(ConfigError, match="2 numbers"):
        ImpactDetector(3, ImpactConfig(r_b_nm_s=(1.0, 2.0)))
    with pytest.raises(ConfigError, match="r_b_nm_s"):
        ImpactConfig(r_b_nm_s=0.0)
    with pytest.raises(TactfulError, match="shape"):
        ImpactDetector(2).run([0.0], [[1.0]])
    with pytest.raises(TactfulError, match="does not increase at sample 1"):
        ImpactDetector(1).run([0.0, 0.0], [[1.0], [1.0]])
