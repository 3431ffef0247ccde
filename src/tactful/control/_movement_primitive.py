"""A motion of the tip that is learnt from one example."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tactful.control._path import Pose
from tactful.errors import TactfulError

Array = NDArray[np.float64]

_STEP_S = 0.01
_WEIGHT_S = 0.1
"""Time between two basis functions [s]; what is faster is smoothed away."""
_WEIGHTS = (10, 100)
"""Least and largest number of basis functions."""
_LEAST_S = 0.2


class MovementPrimitive:
    r"""A dynamic movement primitive of a pose: it goes as the example did, ends where it ended, and rests there.

    Of each coordinate y with the goal g, with the phase z that falls from 1 to 0.01 in the execution time \tau,

        \tau^2 \ddot y = \alpha (\beta (g - y) - \tau \dot y) + f(z),

    where the forcing term f, a sum of basis functions, is fitted to the example; the orientation follows the same law
    with rotation vectors of quaternions as differences. It is as smooth as its basis functions, 0.1 s apart, whatever
    the example was; executed in another time it keeps its shape. Needs the extra `teach`.

    Sources: A. Ijspeert et al. 2013, doi:10.1162/NECO_a_00393; A. Ude et al. 2014, doi:10.1109/ICRA.2014.6907291
    (orientation); the library movement_primitives, A. Fabisch 2024, doi:10.21105/joss.06695.

    Args:
        t: increasing times of the example (N,) [s], from 0 on in the primitive.
        poses: the N poses of the example.
        slower: by which factor the execution is slower than the example.

    Raises:
        TactfulError: if the library is missing, or the example is shorter than 0.2 s, runs backwards, or is not finite.
    """

    def __init__(self, t: ArrayLike, poses: Sequence[Pose], *, slower: float = 1.0) -> None:
        try:
            from movement_primitives.dmp import CartesianDMP
        except ImportError:
            raise TactfulError('teaching needs movement_primitives: pip install "tactful[teach]"') from None
        times = np.asarray(t, dtype=np.float64)
        if times.ndim != 1 or len(times) != len(poses):
            raise TactfulError(f"an example needs one time a pose, not {times.shape} times and {len(poses)} poses")
        if not slower > 0 or not math.isfinite(slower):
            raise TactfulError(f"slower is {slower:g}: it has to be a positive number")
        if len(times) < 2 or not (np.diff(times) > 0).all() or not times[-1] - times[0] >= _LEAST_S:
            raise TactfulError(f"an example needs increasing times over {_LEAST_S:g} s or more")
        grid, example = _uniform(times - times[0], poses)
        number = int(np.clip(grid[-1] / _WEIGHT_S, *_WEIGHTS))
        primitive = CartesianDMP(execution_time=float(grid[-1]), dt=_STEP_S, n_weights_per_dim=number)
        primitive.imitate(grid, example)
        primitive.configure(start_y=example[0], goal_y=example[-1])
        self._slower = slower
        _, track = primitive.open_loop()
        self._position: Array = np.ascontiguousarray(track[:, :3])  # (m, 3)
        self._rotation: Array = _matrices(track[:, 3:])  # (m, 3, 3)

    @property
    def end_s(self) -> float:
        """When it has come to rest [s]."""
        return (len(self._position) - 1) * _STEP_S * self._slower

    @property
    def points_m(self) -> Array:
        """The positions on its way (m, 3) [m]."""
        return self._position

    def pose(self, t: float) -> Pose:
        """Return the pose at the time t [s]; before the start and after the end it rests."""
        place = min(max(t / (_STEP_S * self._slower), 0.0), len(self._position) - 1.0)
        k = min(int(place), len(self._position) - 2)
        share = place - k
        position = self._position[k] + share * (self._position[k + 1] - self._position[k])
        return Pose(self._rotation[k + round(share)], position)

    def slower(self, factor: float) -> MovementPrimitive:
        """Return the same motion, executed in a time longer by a factor."""
        copy = object.__new__(MovementPrimitive)
        copy._position, copy._rotation, copy._slower = self._position, self._rotation, self._slower * factor
        return copy


def _uniform(t: Array, poses: Sequence[Pose]) -> tuple[Array, Array]:
    """Return times at a fixed step (m,) and the poses there, position and quaternion with w first (m, 7)."""
    from scipy.spatial.transform import Rotation, Slerp

    position = np.array([pose.position_m for pose in poses], dtype=np.float64)  # (N, 3)
    rotation = np.array([pose.rotation for pose in poses], dtype=np.float64)  # (N, 3, 3)
    if not (np.isfinite(position).all() and np.isfinite(rotation).all()):
        raise TactfulError("an example has poses that are not finite")
    steps = max(round(t[-1] / _STEP_S), 2)
    grid = np.arange(steps + 1) * _STEP_S
    inside = np.minimum(grid, t[-1])
    quaternion = Slerp(t, Rotation.from_matrix(rotation))(inside).as_quat(scalar_first=True)
    quaternion[1:] *= np.cumprod(np.where((quaternion[1:] * quaternion[:-1]).sum(axis=1) < 0, -1.0, 1.0))[:, None]
    columns = [np.interp(inside, t, position[:, i]) for i in range(3)]
    return grid, np.column_stack([*columns, quaternion])


def _matrices(quaternion: Array) -> Any:
    from scipy.spatial.transform import Rotation

    return Rotation.from_quat(quaternion, scalar_first=True).as_matrix()
