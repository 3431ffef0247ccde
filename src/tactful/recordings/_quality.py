"""How regular and complete the rows of a recording are."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

GAP_FACTOR = 3.0
"""A step longer than this many median steps is a gap."""


@dataclass(frozen=True)
class Quality:
    """Counts of what is irregular; the rows themselves are kept as they are.

    Attributes:
        rows: number of rows.
        median_step_s: median of the positive time steps [s]; nan where there is none.
        jitter_s: standard deviation of the positive steps that are no gaps [s].
        shortest_step_s: shortest positive step [s].
        longest_step_s: longest step [s].
        repeated_rows: rows whose channels all equal the row before, bit for bit: a stale sample was logged again.
        repeated_stamps: steps of exactly zero.
        backward_steps: steps in which time runs backward.
        gaps: steps longer than three median steps.
        longest_gap_s: the longest of them [s]; 0 without gaps.
        nonfinite_rows: rows with a NaN or an infinity in time or any channel.
    """

    rows: int
    median_step_s: float
    jitter_s: float
    shortest_step_s: float
    longest_step_s: float
    repeated_rows: int
    repeated_stamps: int
    backward_steps: int
    gaps: int
    longest_gap_s: float
    nonfinite_rows: int

    @classmethod
    def of(cls, t: NDArray[np.float64], channels: Mapping[str, NDArray[np.float64]]) -> Quality:
        """Count over time stamps `t` (N,) [s] and channels (N, k)."""
        step = np.diff(t[np.isfinite(t)])
        forward = step[step > 0]
        median = float(np.median(forward)) if forward.size else float("nan")
        gap = forward[forward > GAP_FACTOR * median]
        regular = forward[forward <= GAP_FACTOR * median]
        same = np.full(max(len(t) - 1, 0), bool(channels))
        finite = np.isfinite(t)
        for values in channels.values():
            for column in values.T:
                same &= column[1:] == column[:-1]
                finite &= np.isfinite(column)
        return cls(
            rows=len(t),
            median_step_s=median,
            jitter_s=float(np.std(regular)) if regular.size else float("nan"),
            shortest_step_s=float(forward.min()) if forward.size else float("nan"),
            longest_step_s=float(forward.max()) if forward.size else float("nan"),
            repeated_rows=int(np.count_nonzero(same)),
            repeated_stamps=int(np.count_nonzero(step == 0)),
            backward_steps=int(np.count_nonzero(step < 0)),
            gaps=len(gap),
            longest_gap_s=float(gap.max()) if gap.size else 0.0,
            nonfinite_rows=int(np.count_nonzero(~finite)),
        )
