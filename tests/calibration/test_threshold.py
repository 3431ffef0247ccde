import numpy as np
import pytest
from scipy import stats
from scipy.signal import lfilter

from tactful.calibration import threshold_for_rate
from tactful.errors import TactfulError


def test_threshold_of_independent_gaussian_samples_is_the_known_one() -> None:
    """The maximum of independent samples has a distribution in closed form: an analytic case."""
    rng = np.random.default_rng(0)
    rate_hz, per_hour = 100.0, 2.0
    exact = stats.norm.isf(per_hour / 3600 / rate_hz / 2)
    found = threshold_for_rate(np.abs(rng.normal(size=60_000)), rate_hz, per_hour, separation_s=0.05, amplitude=True)
    assert found.low < exact < found.high
    assert found.value == pytest.approx(exact, rel=0.1)


@pytest.mark.parametrize("correlation", [0.0, 0.9])
def test_interval_covers_the_true_level(correlation: float) -> None:
    """A 90 % interval that covers half of the time would promise a rate of false alarms that nobody gets."""
    rng = np.random.default_rng(1)
    rate_hz, per_hour, runs = 100.0, 12.0, 60
    scale = np.sqrt(1 - correlation**2)

    def noise(count: int) -> np.ndarray:
        return np.abs(lfilter([scale], [1, -correlation], rng.normal(size=count)))

    blocks = noise(12_000_000).reshape(-1, 50).max(axis=1)  # half a second each
    exact = np.quantile(blocks, 1 - per_hour / 3600 * 0.5)
    inside = 0
    for _ in range(runs):
        found = threshold_for_rate(noise(6_000), rate_hz, per_hour, separation_s=0.5, amplitude=True)
        inside += found.low <= exact <= found.high
    assert inside >= 0.8 * runs


def test_statement_says_whether_the_recording_is_long_enough() -> None:
    """Nobody should take an extrapolation for a measurement."""
    x = np.random.default_rng(2).exponential(size=36_000)
    short = threshold_for_rate(x, 100.0, 0.125)
    assert not short.supported
    assert "not supported by 6 min" in short.statement
    assert "record 24 h" in short.statement
    supported = threshold_for_rate(x, 100.0, 60.0)
    assert supported.supported
    assert "one false alarm in 60 s is supported" in supported.statement


def test_rarer_alarms_need_a_higher_threshold() -> None:
    """An invariant of any rate."""
    x = np.random.default_rng(3).exponential(size=10_000)
    values = [threshold_for_rate(x, 100.0, rate).value for rate in (10.0, 1.0, 0.1)]
    assert values == sorted(values)


@pytest.mark.parametrize(
    ("statistic", "rate", "text"),
    [
        (np.ones(20), 1.0, "too short for a threshold"),
        (np.array([1.0, np.nan] * 500), 1.0, "500 values that are not finite"),
        (np.ones(1000), 0.0, "must be positive, not 0.0"),
        (np.zeros(0), 1.0, "too short for a threshold"),
    ],
)
def test_bad_input_is_one_line(statistic: np.ndarray, rate: float, text: str) -> None:
    """A threshold from nothing would be a number all the same."""
    with pytest.raises(TactfulError, match=text) as error:
        threshold_for_rate(statistic, 100.0, rate)
    assert "\n" not in str(error.value)
