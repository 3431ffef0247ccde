"""The parts of the aim-aware study."""

import numpy as np
import pytest

from tactful.classification import AimAware, AimAwareConfig
from tactful.errors import TactfulError
from tactful.simulation.planar import PlanarConfig, simulate_impacts
from tactful.studies.aim_aware import Bands, Judged, cases, judge, tune
from tactful.studies.aim_aware._summary import R_B_TABLE1

BETA = np.arange(-5.0, 5.1)


def _bands(rates: list[float]) -> Bands:
    return Bands(np.arange(-5.0, 6.0), np.array(rates), np.full(11, 10))


def test_band_ambiguous_and_beyond() -> None:
    """Band: all accepted about zero; ambiguous: next to it, at times; beyond: behind the first never accepted."""
    bands = _bands([0.2, 0, 0.5, 1, 1, 1, 1, 0.1, 0.3, 0, 0])
    assert bands.band_deg == (-2.0, 1.0)
    assert bands.ambiguous_deg == (1.0, 2.0)
    assert bands.accepted_beyond == pytest.approx(0.2 / 4)
    assert bands.within(1.0) == 1.0
    assert bands.within(2.0) == pytest.approx((4 + 0.1) / 5)


def test_no_band_where_zero_is_refused_at_times() -> None:
    """A classifier that refuses planned impacts has no band at all."""
    assert _bands([0, 0, 0, 0, 0, 0.9, 0, 0, 0, 0, 0]).band_deg is None
    assert _bands([1] * 11).ambiguous_deg == (0.0, 0.0)
    assert _bands([1] * 11).accepted_beyond == 0.0


def test_bands_count_by_inclination() -> None:
    """Impacts of one inclination stand together, whatever their order."""
    bands = Bands.of(np.array([1.0, 0.0, 1.0, 0.0]), np.array([True, True, False, True]))
    assert bands.rate.tolist() == [1.0, 0.5]
    assert bands.count.tolist() == [2, 2]


def test_thresholds_after_the_fact_give_the_verdict_of_the_classifier() -> None:
    """The tuning rests on that: what was judged once accepts exactly what the classifier calls expected."""
    planar = PlanarConfig()
    some = cases([70.0, 100.0], [0.26], np.arange(-5.0, 5.1, 1.0))
    configs = [AimAwareConfig.table1(name, impact=R_B_TABLE1) for name in ("strict", "medium", "wide")]
    judged = judge(some, planar, configs)
    runs = simulate_impacts(some, planar)
    for config, seen in zip(configs, judged, strict=True):
        accepted = seen.accepted(config)
        for run, expected in zip(runs, accepted, strict=True):
            aim = AimAware(run.plan, config)
            aim.run(run.t, run.q, run.dq, run.r)
            assert (aim.verdict == "expected") == expected
        assert accepted.any()
        assert not accepted.all()
    error = np.abs(np.degrees(judged[1].turn_rad) - some[:, 2])
    assert error.max() < 1.0


def test_published_settings_reach_the_published_bands() -> None:
    """Tab. 1 verbatim on a part of the grid: 0, about +-2 and about +-4 deg, nothing beyond."""
    some = cases([60.0, 90.0, 120.0], [0.2, 0.3, 0.4], np.arange(-7.0, 7.1, 1.0))
    configs = [AimAwareConfig.table1(name, impact=R_B_TABLE1) for name in ("strict", "medium", "wide")]
    bands = [
        Bands.of(some[:, 2], seen.accepted(config))
        for config, seen in zip(configs, judge(some, PlanarConfig(), configs), strict=True)
    ]
    for found, wanted in zip(bands, (0.0, 2.0, 4.0), strict=True):
        assert found.band_deg is not None
        assert np.abs(np.array(found.band_deg) - [-wanted, wanted]).max() <= 1.0
        assert max(found.ambiguous_deg) <= 2.0
        assert found.accepted_beyond == 0.0


def _seen(needed: list[float]) -> Judged:
    k = len(needed)
    zero = np.zeros(k)
    return Judged(zero, zero, zero, np.array(needed)[:, None], zero, zero)


def test_tuning_takes_what_the_band_needs_and_the_most_selective_envelope() -> None:
    """Thresholds are the largest needed value times the margin; of two envelopes the one that refuses more wins."""
    beta = np.array([-2.0, -1.0, 0.0, 1.0, 2.0])
    loose, tight = AimAwareConfig(a_per_s=10.0), AimAwareConfig(a_per_s=20.0)
    tried = [(loose, _seen([0.1, 0.2, 0.0, 0.1, 0.15])), (tight, _seen([0.5, 0.2, 0.0, 0.1, 0.5]))]
    config = tune(tried, beta, 1.0)
    assert config.a_per_s == 20.0
    assert config.e_m_rad_s == pytest.approx(0.21)
    assert tune(tried, beta, 0.0).e_m_rad_s == 0.01  # the floor


def test_tuning_tells_when_an_impact_is_not_felt() -> None:
    """No threshold makes up for an impact that the detector misses."""
    with pytest.raises(TactfulError, match="lower r_b"):
        tune([(AimAwareConfig(), _seen([np.inf, 0.0]))], np.array([0.0, 5.0]), 1.0)


@pytest.mark.timeout(300)  # two processes start and load their kernels
def test_nothing_depends_on_the_number_of_jobs() -> None:
    """Results that change with the machine are no results."""
    some = cases([80.0], [0.3], np.arange(-2.0, 2.1, 0.02))
    one, two = (judge(some, PlanarConfig(), [AimAwareConfig()], jobs=jobs)[0] for jobs in (1, 2))
    np.testing.assert_array_equal(one.needed_rad_s, two.needed_rad_s)
    with pytest.raises(TactfulError, match="jobs"):
        judge(some, PlanarConfig(), [AimAwareConfig()], jobs=0)
