"""From impacts that are to be accepted, and others, to the settings of the aim-aware classifier."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tactful.classification import AimAwareConfig
from tactful.detection import ImpactConfig, ImpactDetector
from tactful.errors import TactfulError
from tactful.learning._errors import LearningError
from tactful.learning._impacts import THRESHOLDS, Judged, LabelledImpact

Array = NDArray[np.float64]

_TIGHT, _WIDE = 1.05, 1.3
"""What a threshold is above the largest value that an expected impact needs: tight for the one that decides, the tilt
or, without it, e_m. Time and place of an impact jump where a contact merges with another, and decide little."""
_FLOORS = {"e_m_rad_s": 0.01, "epsilon_rad": 0.005, "zeta_s": 0.005, "iota_s": 0.005, "tilt_deg": 0.1}
"""Least thresholds: below, noise alone would exceed them."""
_REACH = (1.0, 1.15, 1.3)
"""By how much the thresholds may grow where it is counted what they accept too much: few at each is a wide gap."""
_FIRST = tuple(
    {"a_per_s": a, "m_max": m_max, "m_c": m_c, "r_b": r_b}
    for a, m_max, m_c, r_b in ((30.0, 25, 25, 0.4), (30.0, 25, 25, 0.6), (18.0, 15, 15, 0.6), (10.0, 35, 25, 0.4))
)
"""What is tried first: the envelope of Tab. 1 of the paper, and such that look at a whole oscillation."""
_NOISE_UNTIL_S, _PEAK_WITHIN_S = 0.005, 0.02
"""Until when before the first contact the rate of r is noise, and how long after it it is the impact [s]."""
_DECAY = 0.03
"""Least r_b as a share of the weakest impact: below, the decay of the residual after an impact looks like another."""
_ABOVE_NOISE = 1.2
"""How much stronger than noise the weakest expected impact has to be."""
_LEAST_USUAL = 0.1
"""Joints whose rate of r is below this share of the largest one at an impact do not tell impacts, and of the others,
where noise hides the weakest one, the joint that is noisiest by its usual rate is left out."""


@dataclass(frozen=True, eq=False)
class ImpactRates:
    """What an impact has to be told from in the rate of the residual; n joints.

    Attributes:
        usual_nm_s: (n,) largest rate after the first contact, the median of the expected impacts [Nm/s].
        noise: largest rate before any contact, as a share of the usual, over all joints that tell impacts.
        weakest: the same after the first contact, in the expected impact where it is smallest.
    """

    usual_nm_s: Array
    noise: float
    weakest: float

    @classmethod
    def of(cls, runs: Sequence[LabelledImpact], impact: ImpactConfig | None = None) -> ImpactRates:
        """Measure them on runs of which it is known when they touch.

        Args:
            runs: impacts of both kinds.
            impact: how the rate is formed.

        Raises:
            LearningError: if no run is expected, or the weakest expected impact is not told from noise.
        """
        noise, peaks = np.zeros(runs[0].plan.n), []
        for run in runs:
            detector = ImpactDetector(run.plan.n, ImpactConfig(bandpass_hz=impact and impact.bandpass_hz))
            rate = np.abs(detector.trace(run.t, run.r)[1])  # (N, n)
            before = run.t < run.touch_s - _NOISE_UNTIL_S
            here = (run.t >= run.touch_s) & (run.t <= run.touch_s + _PEAK_WITHIN_S)
            noise = np.maximum(noise, rate[before].max(axis=0, initial=0.0))
            if run.expected:
                peaks.append(rate[here].max(axis=0, initial=0.0))
        if not peaks:
            raise LearningError("no impact is expected: give some that are")
        usual = np.median(peaks, axis=0)  # (n,)
        used = usual >= _LEAST_USUAL * max(usual.max(), 1e-9)
        while True:
            hidden = np.divide(noise, usual, out=np.zeros_like(noise), where=used)  # (n,)
            weakest = float((np.array(peaks)[:, used] / usual[used]).max(axis=1).min())
            if weakest > _ABOVE_NOISE * hidden.max():
                return cls(np.where(used, usual, np.inf), float(hidden.max()), weakest)
            if used.sum() == 1:
                problem = f"{weakest:.3g} against {hidden.max():.3g} of the usual rate of r"
                remedy = "set aim_aware.impact.bandpass_hz, to 30 Hz say, or another aim_aware.bandwidth_hz"
                raise LearningError(f"the weakest expected impact is not told from noise: {problem}; {remedy}")
            used[int(np.argmax(hidden))] = False

    def between(self, share: float) -> tuple[float, ...]:
        """Return r_b of each joint, from the noise (0) to the weakest impact (1) by ratio; inf for a joint that is out.

        What is lower than a few per cent of the weakest impact would take the decay of the residual for another one.
        """
        low = max(self.noise, _DECAY * self.weakest)
        return tuple(float(f"{low ** (1 - share) * self.weakest**share * usual:.4g}") for usual in self.usual_nm_s)


@dataclass(frozen=True, eq=False)
class ImpactTuning:
    """Settings that accept all expected impacts, and what they rest on.

    Attributes:
        config: the settings.
        rates: what r_b lies between; None where it was kept.
        needed: of each threshold the largest value that an expected impact needs.
        needed_by: the name of that impact.
        accepted_outside: share of the other impacts that are accepted, too.
        gap: by which factor all thresholds could grow until another unexpected impact would be accepted.
        nearest: the name of that impact, and the threshold that still refuses it; None if all are accepted.
    """

    config: AimAwareConfig
    rates: ImpactRates | None
    needed: dict[str, float]
    needed_by: dict[str, str]
    accepted_outside: float
    gap: float
    nearest: tuple[str, str] | None


def thresholds_for(seen: Judged, expected: NDArray[np.bool_], *, tilt: bool = False) -> dict[str, float] | None:
    """Return the least thresholds that accept the expected impacts, with margins and floors; None if none do.

    Args:
        seen: what a classifier saw of k impacts.
        expected: which of them are to be accepted (k,).
        tilt: whether the tilt of the tool is judged, too.
    """
    needed = dict(zip(THRESHOLDS, seen.needed()[expected].max(axis=0).tolist(), strict=True))
    if not tilt:
        del needed["tilt_deg"]
    if not np.isfinite(list(needed.values())).all():
        return None
    decides = "tilt_deg" if tilt else "e_m_rad_s"
    return {name: max(_FLOORS[name], (_TIGHT if name == decides else _WIDE) * x) for name, x in needed.items()}


def tune_impacts(
    runs: Sequence[LabelledImpact],
    *,
    base: AimAwareConfig | None = None,
    tilt: bool = False,
    place_r_b: bool = True,
    trials: int = 60,
    seed: int = 0,
    progress: Callable[[float], None] = lambda share: None,
) -> ImpactTuning:
    """Choose settings that accept every expected impact, and as few others as they can.

    For a given envelope and r_b the verdict is monotone in e_m, epsilon, zeta and iota: each is the largest value that
    an expected impact needs, with a margin. The rest, a, m_max, m_c and r_b, is searched by a tree-structured
    Parzen estimator (J. Bergstra et al. 2011, "Algorithms for hyper-parameter optimization") for the least share of
    unexpected impacts that is accepted, also by thresholds somewhat larger: a wide gap is likelier to hold for others.
    r_b lies between the noise of the residual's rate and the weakest impact, joint by joint. A margin of its own for
    each joint fits the runs it is tuned on too closely.

    Args:
        runs: impacts of both kinds.
        base: settings whose other values are kept, also xi: the sooner the verdict, the less it rests on.
        tilt: whether the tilt of the tool is judged, too; the paper does not. Plans need their `turn`.
        place_r_b: whether r_b is searched, too, or kept.
        trials: number of settings that are tried.
        seed: of the search.
        progress: is told the share that is done.

    Raises:
        LearningError: if one of the kinds is missing, an expected impact had no contact, is not told from noise or not
            felt under any settings that were tried.
        TactfulError: if optuna is missing.
    """
    try:
        import optuna
    except ImportError:
        raise TactfulError('tuning to planned impacts needs optuna: pip install "tactful[learn]"') from None
    expected = np.array([run.expected for run in runs], dtype=bool)
    if expected.all() or not expected.any():
        raise LearningError(f"{expected.sum()} of {len(runs)} impacts are expected: give some that are, and others")
    start = base or AimAwareConfig()
    rates = ImpactRates.of(runs, start.impact) if place_r_b else None
    found: dict[int, tuple[AimAwareConfig, Judged]] = {}

    def attempt(trial: Any) -> float:
        shape = _shape(trial, start, rates)
        seen = Judged.of(runs, shape)
        thresholds = thresholds_for(seen, expected, tilt=tilt)
        progress((trial.number + 1) / trials)
        if thresholds is None:
            return 2.0
        found[trial.number] = shape.model_copy(update=thresholds), seen
        excess = _excess(seen, thresholds)[~expected].max(axis=1)
        return float(np.mean([(excess <= reach).mean() for reach in _REACH]))

    optuna.logging.set_verbosity(optuna.logging.WARNING)
    study = optuna.create_study(sampler=optuna.samplers.TPESampler(seed=seed, n_startup_trials=max(5, trials // 4)))
    for first in _FIRST:
        study.enqueue_trial(first)
    study.optimize(attempt, n_trials=trials)
    if study.best_trial.number not in found:
        raise LearningError("an expected impact is not felt, or has no verdict, whatever the settings")
    config, seen = found[study.best_trial.number]
    return _explain(config, seen, expected, runs, rates)


def _shape(trial: Any, start: AimAwareConfig, rates: ImpactRates | None) -> AimAwareConfig:
    """Return what a trial suggests: everything but the thresholds."""
    update = {
        "a_per_s": trial.suggest_float("a_per_s", 5.0, 60.0, log=True),
        "m_max": trial.suggest_int("m_max", 5, 40),
        "m_c": trial.suggest_int("m_c", 5, 40),
    }
    if rates is not None:
        r_b = rates.between(trial.suggest_float("r_b", 0.15, 0.9))
        update["impact"] = start.impact.model_copy(update={"r_b_nm_s": r_b})
    return start.model_copy(update=update)


def _excess(seen: Judged, thresholds: dict[str, float]) -> Array:
    """Return needed over given value of each threshold (k, 5); 0 for one that is not given."""
    given = np.array([thresholds.get(name) or np.inf for name in THRESHOLDS])
    used = np.isfinite(given)
    excess = np.zeros((len(seen.position_rad), len(THRESHOLDS)))
    excess[:, used] = np.maximum(seen.needed()[:, used], 0.0) / given[used]
    return excess


def _explain(
    config: AimAwareConfig,
    seen: Judged,
    expected: NDArray[np.bool_],
    runs: Sequence[LabelledImpact],
    rates: ImpactRates | None,
) -> ImpactTuning:
    needed = seen.needed()
    used = [k for k, name in enumerate(THRESHOLDS) if getattr(config, name) is not None]
    rows = [int(row) for row in np.argmax(np.where(expected[:, None], needed, -np.inf), axis=0)]
    excess = _excess(seen, {THRESHOLDS[k]: getattr(config, THRESHOLDS[k]) for k in used})
    refused = np.flatnonzero(~expected & (excess.max(axis=1) > 1))
    gap, nearest = np.inf, None
    if len(refused):
        row = int(refused[np.argmin(excess[refused].max(axis=1))])
        gap, nearest = float(excess[row].max()), (runs[row].name, THRESHOLDS[int(np.argmax(excess[row]))])
    return ImpactTuning(
        config=config,
        rates=rates,
        needed={THRESHOLDS[k]: float(needed[rows[k], k]) for k in used},
        needed_by={THRESHOLDS[k]: runs[rows[k]].name for k in used},
        accepted_outside=float(seen.accepted(config)[~expected].mean()),
        gap=gap,
        nearest=nearest,
    )
