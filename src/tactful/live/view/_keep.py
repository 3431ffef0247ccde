"""What becomes of a way that a hand has led: the arm goes it by itself from then on."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tactful.control import MinimumJerkPath, Pose, minimum_jerk
from tactful.reaction import TaughtPath
from tactful.simulation import Rounds

Array = NDArray[np.float64]

_SPACING_M = 0.01
_SMOOTH_M = 0.06
"""Over so much of the way, corners are rounded [m]."""


class LedPath(MinimumJerkPath):
    """A way through many poses, from rest to rest in one go; its orientation turns evenly from the first to the last.

    Args:
        points_m: (k, 3) [m].
        first: the pose at the start.
        last: the pose at the end.
        end_s: when it is reached [s].
    """

    def __init__(self, points_m: Array, first: Pose, last: Pose, end_s: float) -> None:
        super().__init__([(0.0, first), (end_s, last)])
        way = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points_m, axis=0), axis=1))])
        self._points, self._share = points_m, way / way[-1]

    def pose(self, t: float) -> Pose:
        """Return the pose at the time t [s]."""
        turned = super().pose(t)
        s = minimum_jerk(t / self.end_s)
        return Pose(turned.rotation, np.array([np.interp(s, self._share, x) for x in self._points.T]))


def keep(taught: TaughtPath, plan: Rounds) -> Rounds:
    """Return rounds that go the way that a hand has led, in the place of the part of theirs that it left out.

    What the hand led counts from where it took the tip off its way to where it let go; before and after that, the way
    is the old one. Both ways, there and back, change. Pauses of the hand are left out, and corners rounded.

    Args:
        taught: the way of the hand.
        plan: the rounds in which it took over.
    """
    path = plan.path
    _, back = plan.along(taught.plan_s)
    old = np.array([path.pose(t).position_m for t in np.linspace(0, path.end_s, 200)])
    led = np.array([pose.position_m for pose in taught.poses])
    if back:
        led = led[::-1]
    first, last = path.pose(0.0), path.pose(path.end_s)
    ahead = last.position_m - first.position_m
    begin, end = sorted(float((p - first.position_m) @ ahead) for p in (led[0], led[-1]))
    along = (old - first.position_m) @ ahead
    before, after = old[along < begin], old[along > end]
    points = _even(np.concatenate([before, led, after]) if len(before) or len(after) else led)
    points = np.concatenate([[first.position_m], _smooth(points), [last.position_m]])
    length = np.linalg.norm(np.diff(points, axis=0), axis=1).sum()
    end_s = path.end_s * max(1.0, float(length / max(np.linalg.norm(ahead), 1e-9)))
    return Rounds(LedPath(points, first, last, end_s), plan.rest_s)


def _even(points: Array) -> Array:
    """Return points at even distances on the same way (k, 3)."""
    way = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    places = np.linspace(0, way[-1], max(2, round(way[-1] / _SPACING_M)))
    return np.stack([np.interp(places, way, x) for x in points.T], axis=1)


def _smooth(points: Array) -> Array:
    from scipy.ndimage import gaussian_filter1d

    return np.asarray(gaussian_filter1d(points, _SMOOTH_M / _SPACING_M / 2, axis=0, mode="nearest"))
