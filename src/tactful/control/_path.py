"""Smooth reference motions of the tip."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tactful.errors import TactfulError

Array = NDArray[np.float64]


class Pose(NamedTuple):
    """A pose in the base: rotation (3, 3) and position (3,) [m]."""

    rotation: Array
    position_m: Array


def minimum_jerk(s: float) -> float:
    """Return the share of the way, 10 s^3 - 15 s^4 + 6 s^5, at the share s of the time; 0 before 0 and 1 after 1.

    Source: T. Flash, N. Hogan 1985, doi:10.1523/JNEUROSCI.05-07-01688.1985.
    """
    s = min(max(s, 0.0), 1.0)
    return s * s * s * (10.0 + s * (6.0 * s - 15.0))


@dataclass(frozen=True, slots=True)
class _Stop:
    t: float
    position_m: Array
    rotation: Array
    turn: Array
    """Rotation vector (3,) in base axes from the stop before [rad]."""


class MinimumJerkPath:
    """Go through poses, from rest to rest, along straight lines and about fixed axes, each with minimum jerk.

    Args:
        stops: time [s] and pose of every stop, in order of time.

    Raises:
        TactfulError: if there is no stop, or time does not advance from one to the next.

    Example:
        >>> import numpy as np
        >>> from tactful.control import MinimumJerkPath, Pose
        >>> path = MinimumJerkPath([(0.0, Pose(np.eye(3), np.zeros(3))), (2.0, Pose(np.eye(3), np.array([0.4, 0, 0])))])
        >>> path.pose(1.0).position_m[0]
        np.float64(0.2)
    """

    def __init__(self, stops: Iterable[tuple[float, tuple[ArrayLike, ArrayLike]]]) -> None:
        from scipy.spatial.transform import Rotation

        self._stops: list[_Stop] = []
        for t, (rotation, position) in stops:
            R, p = np.array(rotation, dtype=np.float64), np.array(position, dtype=np.float64)
            turn = np.zeros(3)
            if self._stops:
                before = self._stops[-1]
                if not t > before.t:
                    raise TactfulError(f"path: the stop at {t:g} s follows one at {before.t:g} s; time has to advance")
                turn = Rotation.from_matrix(R @ before.rotation.T).as_rotvec()
            self._stops.append(_Stop(float(t), p, R, turn))
        if not self._stops:
            raise TactfulError("path: has no stop; give at least one time and pose")
        self._from_rotvec = Rotation.from_rotvec

    @property
    def end_s(self) -> float:
        """Time of the last stop [s]."""
        return self._stops[-1].t

    def pose(self, t: float) -> Pose:
        """Return the pose at the time t [s]; before the first and after the last stop it rests."""
        stops = self._stops
        if t <= stops[0].t:
            return Pose(stops[0].rotation, stops[0].position_m)
        for before, after in pairwise(stops):
            if t < after.t:
                share = minimum_jerk((t - before.t) / (after.t - before.t))
                position = before.position_m + share * (after.position_m - before.position_m)
                if not after.turn.any():
                    return Pose(before.rotation, position)
                return Pose(self._from_rotvec(share * after.turn).as_matrix() @ before.rotation, position)
        return Pose(stops[-1].rotation, stops[-1].position_m)
