"""Hands that touch the arm."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from tactful.control import minimum_jerk

Array = NDArray[np.float64]


class Hand(Protocol):
    """A force on one point of one link, from a person who helps."""

    @property
    def link(self) -> str:
        """Name of the link that it touches."""
        ...

    @property
    def point_m(self) -> tuple[float, float, float]:
        """The point that it touches, in the link's frame [m]."""
        ...

    def force(self, t: float, position_m: Array, velocity_m_s: Array) -> Array:
        """Return the force on the link (3,), base axes [N]; exactly zero where the hand does not touch.

        Args:
            t: time [s].
            position_m: where the point is, in the base (3,) [m].
            velocity_m_s: its velocity (3,) [m/s].
        """
        ...


@dataclass(frozen=True, kw_only=True)
class _Touch:
    """When a hand touches, and where.

    Attributes:
        link: name of the link.
        point_m: (3,) the point in the link's frame [m].
        start_s: when it touches first [s].
        rise_s: time until it acts fully [s].
        hold_s: time for which it does [s].
        fall_s: time in which it lets go [s].
    """

    link: str
    point_m: tuple[float, float, float] = (0.0, 0.0, 0.0)
    start_s: float
    rise_s: float = 0.12
    hold_s: float
    fall_s: float = 0.2

    def grip(self, t: float) -> float:
        """Return the share of the hand's full action at the time t [s]: minimum-jerk rise and fall."""
        since = t - self.start_s
        released = since - self.rise_s - self.hold_s
        return minimum_jerk(since / self.rise_s) if released < 0 else 1.0 - minimum_jerk(released / self.fall_s)


@dataclass(frozen=True, kw_only=True)
class Push(_Touch):
    """A hand that pushes with a given force, however the arm moves.

    Attributes:
        force_n: (3,) the force, base axes [N].
    """

    force_n: tuple[float, float, float]

    def force(self, t: float, position_m: Array, velocity_m_s: Array) -> Array:
        """Return the force on the link (3,), base axes [N]."""
        return self.grip(t) * np.array(self.force_n)


@dataclass(frozen=True, kw_only=True)
class Guide(_Touch):
    """A hand that takes hold of a point and draws it somewhere, as a spring and a damper.

    F = grip(t) (K (target - x) - D dx/dt), with the spring's part at most `strength_n`.

    Attributes:
        target_m: (3,) where the point is to go, in the base [m].
        stiffness_n_m: K [N/m].
        damping_ns_m: D [Ns/m].
        strength_n: largest force of the spring [N].
    """

    target_m: tuple[float, float, float]
    stiffness_n_m: float = 300.0
    damping_ns_m: float = 15.0
    strength_n: float = 20.0

    def force(self, t: float, position_m: Array, velocity_m_s: Array) -> Array:
        """Return the force on the link (3,), base axes [N]."""
        grip = self.grip(t)
        spring = self.stiffness_n_m * (np.array(self.target_m) - position_m)
        spring *= min(1.0, self.strength_n / max(float(np.linalg.norm(spring)), 1e-9))
        return np.asarray(grip * (spring - self.damping_ns_m * velocity_m_s))
