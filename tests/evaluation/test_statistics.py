"""Intervals and spreads against their definitions."""

import math

import numpy as np
import pytest
from scipy.stats import poisson

from tactful.evaluation import Rate, Share, Spread

Z = 1.959963984540054


@pytest.mark.parametrize(("count", "total"), [(0, 1), (0, 30), (1, 30), (15, 30), (30, 30), (192, 210)])
def test_share_interval_is_wilsons(count: int, total: int) -> None:
    """The closed form, and its definition: at both ends the observed share is z standard errors away."""
    p, n = count / total, total
    centre, half = (p + Z**2 / (2 * n)), Z * math.sqrt(p * (1 - p) / n + Z**2 / (4 * n**2))
    low, high = Share(count, total).interval
    assert low == pytest.approx(max(0.0, (centre - half) / (1 + Z**2 / n)), abs=1e-9)
    assert high == pytest.approx(min(1.0, (centre + half) / (1 + Z**2 / n)), abs=1e-9)
    for end in (low, high):
        if 0 < end < 1:
            assert abs(p - end) == pytest.approx(Z * math.sqrt(end * (1 - end) / n))


def test_the_papers_shares() -> None:
    """Table I of the kinesthetic paper: 192 of 210 are 91.4 %."""
    assert Share(192, 210).value == pytest.approx(0.914, abs=5e-4)


@pytest.mark.parametrize("count", [0, 1, 2, 10, 100])
def test_rate_interval_is_exact(count: int) -> None:
    """Garwood's ends: there, so many or more (or fewer) alarms have a probability of 2.5 %."""
    low, high = Rate(count, 2.0).interval
    assert poisson.cdf(count, 2.0 * high) == pytest.approx(0.025)
    if count:
        assert poisson.sf(count - 1, 2.0 * low) == pytest.approx(0.025)
    else:
        assert low == 0
        assert high == pytest.approx(-math.log(0.025) / 2)  # the closed form; one-sided it would be the rule of three


def test_rate_interval_covers() -> None:
    """Brute force: in 4000 drawn experiments the true rate lies in the interval at least 95 % of the time."""
    counts = np.random.default_rng(0).poisson(3.0, 4000)
    inside = {int(k): Rate(int(k), 1.0).interval for k in np.unique(counts)}
    assert np.mean([inside[int(k)][0] <= 3.0 <= inside[int(k)][1] for k in counts]) > 0.95


def test_nothing_is_said_of_nothing() -> None:
    """No contact and no time give no figure, not a perfect one, and JSON holds no nan."""
    assert math.isnan(Share(0, 0).value)
    assert Share(0, 0).interval == (0, 1)
    assert math.isnan(Rate(0, 0.0).per_hour)
    assert Rate(0, 0.0).to_dict() == {"count": 0, "hours": 0.0, "per_hour": None, "low": 0.0, "high": None}
    assert Spread.of([None]).to_dict() == {"n": 0, "mean": None, "sd": None, "median": None, "p95": None}


def test_spread() -> None:
    """Mean, sample standard deviation, median and quantile of values that can be computed by hand."""
    spread = Spread.of([1.0, 2.0, None, 3.0, 4.0])
    assert (spread.n, spread.mean, spread.median) == (4, 2.5, 2.5)
    assert spread.sd == pytest.approx(math.sqrt(5 / 3))
    assert spread.p95 == pytest.approx(3.85)
    assert math.isnan(Spread.of([1.0]).sd)
