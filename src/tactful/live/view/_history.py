"""What the page remembers of the signals."""

from __future__ import annotations

import numpy as np

from tactful.live.view._messages import Array, Trace

_KEPT_S = 120.0


class History:
    """The rows of a trace, in the order in which they came, for two minutes at least; a whole recording stays whole."""

    def __init__(self, past: Trace | None = None) -> None:
        self._parts: list[Trace] = [past] if past is not None else []
        self._whole = past is not None

    def add(self, trace: Trace) -> None:
        """Add rows that are later than all others."""
        if not len(trace.t):
            return
        self._parts.append(trace)
        if len(self._parts) > 400:
            joined = self._joined()
            keep = joined.t >= joined.t[-1] - _KEPT_S
            self._parts = [Trace(*(column[keep] for column in joined))]

    @property
    def end_s(self) -> float:
        """Time of the last row [s]."""
        return float(self._parts[-1].t[-1]) if self._parts else 0.0

    def window(self, start_s: float, end_s: float) -> Trace | None:
        """Return the rows between two times [s], None if there are none."""
        if not self._parts:
            return None
        parts = [part for part in self._parts if part.t[-1] >= start_s and part.t[0] <= end_s]
        if not parts:
            return None
        joined = Trace(*(np.concatenate(columns) for columns in zip(*parts, strict=True)))
        first, last = np.searchsorted(joined.t, [start_s, end_s])
        return Trace(*(column[first:last] for column in joined)) if last > first else None

    def _joined(self) -> Trace:
        return Trace(*(np.concatenate(columns) for columns in zip(*self._parts, strict=True)))


def norm(force_n: Array) -> Array:
    """Return the magnitudes (N,) of forces (N, 3) [N]."""
    return np.asarray(np.linalg.norm(force_n, axis=1))
