"""References for a motion with an impact: one until it, one after it, both known at all times."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tactful._njit import njit
from tactful.errors import TactfulError
from tactful.robots._frozen import FrozenRecord, frozen_array

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class ReferenceSpreading(FrozenRecord):
    r"""Ante- and post-impact references x_d(t) of m coordinates, quintic polynomials that overlap in time.

    The ante-impact reference leads from rest at t_0 to the pose of the impact at t_d, which it reaches with the
    velocity before the impact; the post-impact reference starts there with the velocity after it, which an impact map
    says, and comes to rest at t_f. Accelerations are zero at all these times. Beyond its own times each reference goes
    on at constant velocity, so that an impact that comes early or late finds a reference on both sides.

    Sources: M. Rijnen, A. Saccon, H. Nijmeijer 2019, doi:10.1109/TCST.2018.2811845 (reference spreading); J. van Steen,
    N. van de Wouw, A. Saccon 2022, doi:10.23919/ACC53348.2022.9867702 (simultaneous impacts); B. Proper et al. 2023,
    https://hal.science/hal-03974694v3, Sec. III-A (the polynomials).

    Attributes:
        times_s: (3,) t_0, t_d and t_f [s].
        coefficients: (2, m, 6) of the powers of the time since t_0 (ante) and t_d (post) [SI].

    Example:
        >>> from tactful.control import ReferenceSpreading
        >>> spread = ReferenceSpreading.between((0.0, 0.5, 1.0), [[0.075], [0.0], [0.0]], [[-0.3], [0.0]])
        >>> round(float(spread.at(0.6, post=False)[0][0]), 6)
        -0.03
    """

    times_s: Array
    coefficients: Array

    def __post_init__(self) -> None:
        for name in ("times_s", "coefficients"):
            object.__setattr__(self, name, frozen_array(getattr(self, name)))
        shape = self.coefficients.shape
        if (
            self.times_s.shape != (3,)
            or len(shape) != 3
            or shape[::2] != (2, 6)
            or not (np.diff(self.times_s) > 0).all()
        ):
            problem = f"times {self.times_s.tolist()}, coefficients {shape}"
            raise TactfulError(f"reference spreading: {problem}; expected 3 increasing times and (2, m, 6)")

    @classmethod
    def between(
        cls, times_s: tuple[float, float, float], poses: ArrayLike, impact_velocities: ArrayLike
    ) -> ReferenceSpreading:
        """Return the references through three poses.

        Args:
            times_s: t_0, t_d and t_f [s].
            poses: (3, m) at these times.
            impact_velocities: (2, m) at t_d, before and after the impact.
        """
        times, x, v = (np.asarray(value, dtype=np.float64) for value in (times_s, poses, impact_velocities))
        if times.shape != (3,) or x.ndim != 2 or len(x) != 3 or v.shape != (2, x.shape[1]):
            shapes = f"times {times.shape}, poses {x.shape}, velocities {v.shape}"
            raise TactfulError(f"reference spreading: {shapes}; expected (3,), (3, m) and (2, m)")
        rest = np.zeros(x.shape[1])
        pieces = [
            _quintic(times[1] - times[0], x[0], rest, x[1], v[0]),
            _quintic(times[2] - times[1], x[1], v[1], x[2], rest),
        ]
        return cls(times, np.array(pieces))

    @property
    def m(self) -> int:
        """Number of coordinates."""
        return len(self.coefficients[0])

    def at(self, t: float, *, post: bool) -> tuple[Array, Array, Array]:
        """Return position, velocity and acceleration (m,) of one of the references at the time t [s]."""
        x, dx, ddx = np.empty((3, self.m))
        spread(self.times_s, self.coefficients, post, t, x, dx, ddx)
        return x, dx, ddx


def _quintic(T: float, x0: Array, v0: Array, x1: Array, v1: Array) -> Array:
    """Return the coefficients (m, 6) of the quintic over T [s] with these ends and no acceleration at them."""
    d = x1 - x0 - v0 * T
    w = (v1 - v0) * T
    return np.stack([x0, v0, 0 * x0, (10 * d - 4 * w) / T**3, (-15 * d + 7 * w) / T**4, (6 * d - 3 * w) / T**5], axis=1)


@njit(cache=True)
def spread(times: Array, coefficients: Array, post: bool, t: float, x: Array, dx: Array, ddx: Array) -> None:
    """Set position, velocity and acceleration (m,) of the ante- or post-impact reference at the time t [s]."""
    piece = 1 if post else 0
    start, end = times[piece], times[piece + 1]
    s = min(max(t, start), end) - start
    beyond = t - start - s
    for i in range(x.shape[0]):
        c = coefficients[piece, i]
        x[i] = c[0] + s * (c[1] + s * (c[2] + s * (c[3] + s * (c[4] + s * c[5]))))
        dx[i] = c[1] + s * (2.0 * c[2] + s * (3.0 * c[3] + s * (4.0 * c[4] + s * 5.0 * c[5])))
        ddx[i] = 2.0 * c[2] + s * (6.0 * c[3] + s * (12.0 * c[4] + s * 20.0 * c[5]))
        if beyond != 0.0:
            x[i] += beyond * dx[i]
            ddx[i] = 0.0
