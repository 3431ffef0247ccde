"""What the tip has done lately, to tell where a demonstration began before it was recognised."""

from __future__ import annotations

from collections import deque

import numpy as np

from tactful.control import Pose

TRACE_STEP_S = 0.01
_KEPT_S = 30.0
_REST_S, _REST_M = 1.0, 0.001
"""An arm that is stuck rests; a hand that leads it may rest, too, but not for long."""
_LEFT_M = 0.003


class Trace:
    """The way of the tip, and when it met something first."""

    def __init__(self) -> None:
        self._samples: deque[tuple[float, Pose]] = deque(maxlen=round(_KEPT_S / TRACE_STEP_S))
        self._touched_s: float | None = None
        self.clear_s: float | None = None
        """Time in the plan until which nothing was touched [s]; None while nothing was."""

    def due(self, t: float) -> bool:
        """Return whether a sample is to be noted."""
        return not self._samples or t - self._samples[-1][0] >= TRACE_STEP_S - 1e-9

    def note(self, t: float, tip: Pose) -> None:
        """Note where the tip is."""
        self._samples.append((t, tip))

    def touch(self, onset_s: float, plan_s: float) -> None:
        """Note a contact, told with its onset and the time in the plan at that onset [s]; the first one counts."""
        if self.clear_s is None:
            self._touched_s, self.clear_s = onset_s, max(plan_s, 0.0)

    def led(self) -> list[tuple[float, Pose]]:
        """Return the way since the tip left the place where it rested last after it met something.

        A hand that draws an arm out of a collision is told from it late, as it is slow and the arm resists.
        """
        if self._touched_s is None:
            return []
        samples = [sample for sample in self._samples if sample[0] >= self._touched_s]
        points = np.array([tip.position_m for _, tip in samples]).reshape(-1, 3)  # (N, 3)
        span = round(_REST_S / TRACE_STEP_S)
        for k in range(len(points) - span, -1, -span // 5):
            if np.abs(points[k : k + span] - points[k]).max() < _REST_M:
                near = np.flatnonzero(np.linalg.norm(points - points[k], axis=1) < _LEFT_M)
                return samples[near[-1] :]
        return []
