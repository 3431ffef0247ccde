"""Which joints tell planned impacts."""

from dataclasses import replace

import numpy as np

from tactful.impacts import ImpactPlan
from tactful.learning import ImpactRates, LabelledImpact


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
