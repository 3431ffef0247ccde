"""The parts of the aim-aware study."""

import numpy as np
import pytest

from tactful.classification import AimAwareConfig
from tactful.errors import TactfulError
from tactful.simulation.planar import PlanarConfig
from tactful.studies.aim_aware import Bands, _evidence, cases, judge
from tactful.studies.aim_aware._summary import R_B_TABLE1


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


def test_published_settings_reach_the_published_bands() -> None:
    """Tab. 1 verbatim on a part of the grid: 0, about +-2 and about +-4 deg, nothing beyond."""
    some = cases([60.0, 90.0, 120.0], [0.2, 0.3, 0.4], np.arange(-7.0, 7.1, 1.0))
    configs = [AimAwareConfig.table1(name, impact=R_B_TABLE1) for name in ("strict", "medium", "wide")]
    bands = [
        Bands.of(some[:, 2], seen.accepted(config))
        for config, seen in zip(configs, judge(some, PlanarConfig(), configs)[0], strict=True)
    ]
    for found, wanted in zip(bands, (0.0, 2.0, 4.0), strict=True):
        assert found.band_deg is not None
        assert np.abs(np.array(found.band_deg) - [-wanted, wanted]).max() <= 1.0
        assert max(found.ambiguous_deg) <= 2.0
        assert found.accepted_beyond == 0.0


def test_nothing_depends_on_how_the_work_is_cut(monkeypatch: pytest.MonkeyPatch) -> None:
    """Results that change with the machine are no results; classifiers that differ in thresholds see the same."""
    some = cases([80.0], [0.3], np.arange(-5.0, 5.1, 2.0))
    shape = AimAwareConfig(impact=R_B_TABLE1)
    (one, same), _ = judge(some, PlanarConfig(), [shape, shape.model_copy(update={"e_m_rad_s": 0.3})])
    monkeypatch.setattr(_evidence, "_CHUNK", 2)
    shares: list[int] = []
    (other,), spent = judge(some, PlanarConfig(), [shape], progress=shares.append)
    np.testing.assert_array_equal(one.needed_rad_s, other.needed_rad_s)
    np.testing.assert_array_equal(one.needed_rad_s, same.needed_rad_s)
    assert shares == [2, 2, 2]
    assert spent > 0
    assert np.abs(one.tilt_deg - some[:, 2]).max() < 1.0
    with pytest.raises(TactfulError, match="jobs"):
        judge(some, PlanarConfig(), [AimAwareConfig()], jobs=0)
