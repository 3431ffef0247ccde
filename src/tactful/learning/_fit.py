"""The fit of an additive model to labelled onsets."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from contextlib import AbstractContextManager
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tactful.classification import CONTEXTS
from tactful.errors import TactfulError

Array = NDArray[np.float64]
Groups = NDArray[np.str_]

_QUANTILES = (0.02, 0.2, 0.4, 0.6, 0.8, 0.98)
_STRENGTHS = (0.1, 0.3, 1.0, 3.0)
"""Candidates for the inverse of the penalty."""
_INNER_FOLDS = 5


@dataclass(frozen=True, eq=False, kw_only=True)
class Rows:
    """What is learned from, one row an onset.

    Attributes:
        x: features (r, k), nan where one is not known.
        cooperation: whether it is cooperation (r,).
        context: index of `CONTEXTS` (r,).
        weight: (r,); the onsets of one decision weigh together as one.
        group: what must not be on both sides of a cross-validation (r,).
    """

    x: Array
    cooperation: NDArray[np.bool_]
    context: NDArray[np.int64]
    weight: Array
    group: Groups

    def __getitem__(self, rows: NDArray[np.bool_]) -> Rows:
        """Return some of the rows."""
        return Rows(
            x=self.x[rows],
            cooperation=self.cooperation[rows],
            context=self.context[rows],
            weight=self.weight[rows],
            group=self.group[rows],
        )

    @property
    def both(self) -> bool:
        """Whether both kinds occur."""
        return bool(self.cooperation.any() and not self.cooperation.all())

    def folds(self, most: int = 10) -> Iterator[NDArray[np.bool_]]:
        """Yield which rows are held out: each group once, several at a time where there are many."""
        names = np.unique(self.group)
        for part in np.array_split(names, min(len(names), most)):
            yield np.isin(self.group, part)


@dataclass(frozen=True, eq=False, kw_only=True)
class Curves:
    """The curves of an additive model: knots (k, m), values (c, k, m), offset (c,), and the penalty's inverse."""

    knots: Array
    values: Array
    offset: Array
    strength: float
    scale: tuple[float, float] = field(default=(1.0, 0.0))

    def log_odds(self, rows: Rows) -> Array:
        """Return the log odds (r,) of rows."""
        return np.asarray(self.offset[rows.context] + self.parts(rows).sum(axis=1))

    def parts(self, rows: Rows) -> Array:
        """Return what each feature adds to them (r, k)."""
        parts = np.zeros(rows.x.shape)
        for k, knots in enumerate(self.knots):
            for c in range(len(self.values)):
                here = (rows.context == c) & np.isfinite(rows.x[:, k])
                parts[here, k] = np.interp(rows.x[here, k], knots, self.values[c, k])
        return parts

    def scaled(self, a: float, b: float) -> Curves:
        """Return the curves whose log odds are a times these, plus b."""
        return Curves(
            knots=self.knots,
            values=a * self.values,
            offset=a * self.offset + b,
            strength=self.strength,
            scale=(a, b),
        )


def fit(rows: Rows) -> Curves:
    """Fit the curves, choose the penalty by cross-validation over the groups, and calibrate on what was held out.

    The log odds that the models of the folds give to the groups that they have not seen are scaled to probabilities
    (J. Platt 1999): the scale that makes these right is applied to the model of all groups.
    """
    with _one_thread(), warnings.catch_warnings():
        # separable kinds leave Newton's line search nothing to improve on; another solver goes on by itself then
        warnings.filterwarnings("ignore", module=r"sklearn\.linear_model")
        scores = [_held_out(rows, strength) for strength in _STRENGTHS]
        losses = [_loss(score, rows) for score in scores]
        best = int(np.argmin(losses))
        return _solved(rows, _STRENGTHS[best]).scaled(*_platt(scores[best], rows))


def _one_thread() -> AbstractContextManager[Any]:
    """Keep the linear algebra in one thread: for matrices as small as these, others cost five times what they bring."""
    _learner()
    from threadpoolctl import threadpool_limits  # type: ignore[import-untyped]

    limits: AbstractContextManager[Any] = threadpool_limits(1)
    return limits


def _held_out(rows: Rows, strength: float) -> Array:
    score = np.zeros(len(rows.x))
    for out in rows.folds(_INNER_FOLDS):
        if (others := rows[~out]).both:
            score[out] = _solved(others, strength).log_odds(rows[out])
    return score


def _loss(score: Array, rows: Rows) -> float:
    sign = np.where(rows.cooperation, -1.0, 1.0)
    return float(np.average(np.logaddexp(0.0, sign * score), weights=rows.weight))


def _platt(score: Array, rows: Rows) -> tuple[float, float]:
    """Return the scale and the shift of the log odds that make held-out probabilities right."""
    model = _regression(1e3)
    model.fit(score[:, None], rows.cooperation, sample_weight=rows.weight)
    return min(max(float(model.coef_[0, 0]), 0.05), 1.0), float(model.intercept_[0])


def _regression(strength: float) -> Any:
    return _learner()(C=strength, solver="newton-cholesky", max_iter=100)


def _learner() -> Any:
    try:
        from sklearn.linear_model import LogisticRegression
    except ImportError:
        raise TactfulError('training needs scikit-learn: pip install "tactful[learn]"') from None
    return LogisticRegression


def _solved(rows: Rows, strength: float) -> Curves:
    """Fit the curves with one penalty.

    A curve is a sum of ramps between its knots, so that the penalty on their heights draws it to a constant, smoothly.
    The curves of the second context are those of the first, plus a difference that is penalised, too: a context in
    which there is little to learn from follows the other.
    """
    knots = np.array([_knots(column) for column in rows.x.T])  # (k, m)
    ramps = _ramps(rows.x, knots)  # (r, k, m - 1)
    known = np.isfinite(rows.x)
    weight = rows.weight[:, None] * known  # (r, k)
    mean = np.einsum("rk,rkm->km", weight, ramps) / np.maximum(weight.sum(axis=0), 1e-12)[:, None]  # (k, m - 1)
    design = ((ramps - mean) * known[:, :, None]).reshape(len(rows.x), -1)
    second = (rows.context == 1)[:, None]
    model = _regression(strength)
    model.fit(np.hstack([design, design * second, second]), rows.cooperation, sample_weight=rows.weight)
    k, steps = mean.shape
    heights = model.coef_[0]
    shared = heights[: k * steps].reshape(k, steps)
    other = shared + heights[k * steps : -1].reshape(k, steps)
    values = []
    for slopes in (shared, other):
        curve = np.concatenate([np.zeros((k, 1)), np.cumsum(slopes, axis=1)], axis=1)
        values.append(curve - (slopes * mean).sum(axis=1, keepdims=True))
    intercept = float(model.intercept_[0])
    offset = np.array([intercept, intercept + float(heights[-1])])
    assert len(values) == len(CONTEXTS)
    return Curves(knots=knots, values=np.array(values), offset=offset, strength=strength)


def _knots(column: Array) -> Array:
    """Return the knots (m,) of a feature: quantiles, a little apart where values repeat."""
    there = column[np.isfinite(column)]
    if not len(there):
        return np.arange(len(_QUANTILES), dtype=np.float64)
    knots = np.quantile(there, _QUANTILES)
    least = 1e-3 * max(float(np.ptp(there)), 1.0)
    for j in range(1, len(knots)):
        knots[j] = max(knots[j], knots[j - 1] + least)
    return np.asarray(knots)


def _ramps(x: Array, knots: Array) -> Array:
    """Return (r, k, m - 1): how far each value is between two knots, from 0 to 1."""
    filled = np.where(np.isfinite(x), x, 0.0)
    return np.clip((filled[:, :, None] - knots[:, :-1]) / np.diff(knots, axis=1), 0.0, 1.0)
