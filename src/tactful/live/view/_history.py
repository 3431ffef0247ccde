"""What the page remembers of the signals."""

from __future__ import annotations

import numpy as np

from tactful.live.view._messages import Array, Trace

_KEPT_S = 120.0


class History:
    """The rows of a trace, in the order in which they came, for two minutes at least; a whole recording stays whole."""

    def __init__(self, past: Trace | None = None) -> None:
        self._parts: list[Trace] = [past] if past is not None else []

    def add(self, trace: Trace) -> None:
        """Add rows that are later than all others."""
        if not len(trace.t):
            return
        self._parts.append(trace)
        if len(self._parts) > 400:
            joined = self._joined()
            keep = joined.t >= joined.t[-1] - _KEPT_S
            self._parts = [Trace(*(column[keep] for column in joined))]

    def window(self, start_s: float, end_s: float) -> Trace | None:
        """Return the rows between two times [s], None if there are none."""
        pieces = []
        for part in self._parts:
            if part.t[-1] >= start_s and part.t[0] <= end_s:
                first, last = np.searchsorted(part.t, [start_s, end_s])
                pieces.append([column[first:last] for column in part])
        window = Trace(*(np.concatenate(columns) for columns in zip(*pieces, strict=True))) if pieces else None
        return window if window is not None and len(window.t) else None

    def _joined(self) -> Trace:
        return Trace(*(np.concatenate(columns) for columns in zip(*self._parts, strict=True)))


def norm(force_n: Array) -> Array:
    """Return the magnitudes (N,) of forces (N, 3) [N]."""
    return np.asarray(np.linalg.norm(force_n, axis=1))
