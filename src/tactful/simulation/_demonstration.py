"""References that look as if someone had led the arm through."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tactful.control import Pose, minimum_jerk
from tactful.errors import TactfulError

Array = NDArray[np.float64]

_STEP_S = 0.001
_LEAST_LEG_S = 0.6
_OVERLAP = 0.25
"""Share of a leg during which the next one has begun already."""
_WOBBLE_HZ = (0.3, 2.0)


class Demonstration:
    """A reference of the tip as it is recorded when a person leads the arm, to be replayed against time.

    Movements of minimum jerk lead from each point to the next; each begins before the one before it has ended, so that
    corners are round. Added to that is what a hand does not hold still: slow sinusoids that fade in and out.

    Source: T. Flash, E. Henis 1991, doi:10.1162/jocn.1991.3.3.220, for the superposition of movements.

    Args:
        points_m: the points to lead through (k, 3) [m].
        speed_m_s: mean speed of every leg (k - 1,) [m/s].
        rotations: orientation at the start and at the end (2, 3, 3).
        rng: the source of the wobble.
        start_s: time at which it begins to move [s].
        wobble_m: amplitude of the wobble [m].

    Raises:
        TactfulError: if there are less than two points, or a speed is not positive.
    """

    def __init__(
        self,
        points_m: ArrayLike,
        speed_m_s: Sequence[float],
        rotations: ArrayLike,
        rng: np.random.Generator,
        *,
        start_s: float = 0.3,
        wobble_m: float = 0.001,
    ) -> None:
        from scipy.spatial.transform import Rotation

        points = np.asarray(points_m, dtype=np.float64)  # (k, 3)
        R = np.asarray(rotations, dtype=np.float64)  # (2, 3, 3)
        if points.ndim != 2 or points.shape[1] != 3 or len(points) < 2 or len(speed_m_s) != len(points) - 1:
            raise TactfulError(f"a demonstration needs 2 points or more and a speed a leg, not {points.shape}")
        if min(speed_m_s) <= 0:
            raise TactfulError(f"the speeds of a demonstration have to be positive, not {list(speed_m_s)}")
        ways = np.diff(points, axis=0)  # (k - 1, 3)
        durations = np.maximum(np.linalg.norm(ways, axis=1) / speed_m_s, _LEAST_LEG_S)
        starts = start_s + np.concatenate([[0.0], np.cumsum((1 - _OVERLAP) * durations[:-1])])
        self.legs = tuple(zip(starts.tolist(), (starts + durations).tolist(), strict=True))
        """When each leg begins and ends [s]."""
        self.end_s = max(end for _, end in self.legs)
        """When it has come to rest [s]."""
        t = np.arange(round(self.end_s / _STEP_S) + 2) * _STEP_S  # (N,)
        position = np.tile(points[0], (len(t), 1))  # (N, 3)
        for (begin, end), way in zip(self.legs, ways, strict=True):
            position += _minimum_jerk((t - begin) / (end - begin))[:, None] * way
        share = _minimum_jerk((t - start_s) / (self.end_s - start_s))
        fade = np.sin(np.pi * share) ** 2  # rests at both ends
        frequency, phase = rng.uniform(*_WOBBLE_HZ, size=(2, 3)), rng.uniform(0, 2 * np.pi, size=(2, 3))
        wave = np.sin(2 * np.pi * t[:, None, None] * frequency + phase).sum(axis=1) / np.sqrt(2)  # (N, 3)
        self._position: Array = position + wobble_m * fade[:, None] * wave
        turn = Rotation.from_matrix(R[1] @ R[0].T).as_rotvec()
        self._rotation: Array = Rotation.from_rotvec(share[:, None] * turn).as_matrix() @ R[0]  # (N, 3, 3)

    @property
    def points_m(self) -> Array:
        """The positions every millisecond (N, 3) [m]."""
        return self._position

    def pose(self, t: float) -> Pose:
        """Return the pose at the time t [s], the nearest that was recorded; at the ends it rests."""
        k = min(max(round(t / _STEP_S), 0), len(self._position) - 1)
        return Pose(self._rotation[k], self._position[k])


def _minimum_jerk(s: Array) -> Array:
    return np.array([minimum_jerk(x) for x in s.tolist()])
