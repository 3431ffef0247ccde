"""Which joints tell planned impacts."""

from dataclasses import replace

import numpy as np
import pytest

from tactful.detection import ImpactConfig
from tactful.impacts import ImpactPlan
from tactful.learning import ImpactRates, LabelledImpact, LearningError


def test_a_joint_that_noise_hides_is_left_out() -> None:
    """An arm of many joints has some that feel an impact little, in much noise: the others tell it."""
    plan, t = ImpactPlan(0.3, np.zeros(3), [0.3], np.zeros((1, 3))), np.arange(0.1, 0.6, 1e-3)
    r = np.where(t[:, None] >= 0.3 - 1e-9, [12.0, 2.0, 0.5], 0.0)
    r[:, 1] += np.random.default_rng(0).normal(0, 1.0, len(t))
    run = LabelledImpact("made", plan, t, np.zeros((len(t), 3)), np.zeros((len(t), 3)), r, touch_s=0.3, expected=True)
    rates = ImpactRates.of([run])
    assert np.isfinite(rates.usual_nm_s).tolist() == [True, False, False]
    assert rates.noise < 1e-6
    quiet = replace(run, r=np.where(t[:, None] >= 0.3 - 1e-9, [12.0, 2.0, 0.5], 0.0))
    assert np.isfinite(ImpactRates.of([quiet]).usual_nm_s).tolist() == [True, True, False]


def test_a_band_pass_finds_an_impact_in_noise() -> None:
    """The rates are those of the detector that will look for impacts: its band-pass hears less noise."""
    plan, t = ImpactPlan(0.3, np.zeros(1), [0.3], np.zeros((1, 1))), np.arange(0.1, 0.6, 1e-3)
    r = np.where(t[:, None] >= 0.3 - 1e-9, 6.0, 0.0) + np.random.default_rng(0).normal(0, 1.5, (len(t), 1))
    run = LabelledImpact("made", plan, t, np.zeros((len(t), 1)), np.zeros((len(t), 1)), r, touch_s=0.3, expected=True)
    with pytest.raises(LearningError, match="bandpass_hz"):
        ImpactRates.of([run])
    assert ImpactRates.of([run], ImpactConfig(bandpass_hz=30.0)).weakest > 0.9
