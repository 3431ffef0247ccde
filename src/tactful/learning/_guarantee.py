"""Bounds on a share of errors that hold at a stated confidence, for any sample size."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np


def upper_bound(errors: int, total: int, confidence: float) -> float:
    """Return the exact upper bound on the probability of an error, after `errors` in `total` independent trials.

    It is the p with P(Bin(total, p) <= errors) = 1 - confidence (C. J. Clopper, E. S. Pearson 1934,
    doi:10.1093/biomet/26.4.404), one-sided.
    """
    return _upper_bounds([errors], total, confidence)[0]


def _upper_bounds(errors: Sequence[int], total: int, confidence: float) -> tuple[float, ...]:
    from scipy.stats import beta

    counts = np.asarray(errors)
    bounds = beta.ppf(confidence, counts + 1, np.maximum(total - counts, 1))
    return tuple(np.where(counts >= total, 1.0, bounds).tolist())


def events_needed(share: float, limit: float, confidence: float) -> int | None:
    """Return the least number of trials that supports a limit if this share of them are errors; None if none does.

    `floor(share n)` errors are assumed in n trials.
    """
    if share >= limit:
        return None
    total = 1
    while upper_bound(int(share * total + 1e-9), total, confidence) > limit:
        total = max(total + 1, int(total * 1.01))
    while total > 1 and upper_bound(int(share * (total - 1) + 1e-9), total - 1, confidence) <= limit:
        total -= 1
    return total


@dataclass(frozen=True, slots=True)
class Guarantee:
    """Which candidates keep a limit.

    Attributes:
        certified: how many of the candidates, from the safest on, keep the limit at the stated confidence.
        bounds: the upper bound of each candidate by itself.
    """

    certified: int
    bounds: tuple[float, ...]


def certify(errors: Sequence[int], total: int, *, limit: float, confidence: float) -> Guarantee:
    r"""Find the candidates whose probability of an error is at most `limit`, all of them at once at this confidence.

    The candidates are tested one after the other, from the one that is the safest beforehand, each by the binomial
    p-value of `H_j: p_j > limit`, P(Bin(total, limit) <= errors_j) <= 1 - confidence, until one fails: fixed-sequence
    testing, which needs no correction for their number. The order must not depend on the data.

    Source: Learn then Test, A. N. Angelopoulos et al. 2022, doi:10.48550/arXiv.2110.01052.

    Args:
        errors: of each candidate, the safest first.
        total: independent trials, the same for all.
        limit: the largest probability of an error that is allowed.
        confidence: with which the limit holds for all certified candidates.
    """
    bounds = _upper_bounds(errors, total, confidence)
    certified = next((j for j, bound in enumerate(bounds) if bound > limit), len(bounds))
    return Guarantee(certified, bounds)
