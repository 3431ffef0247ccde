"""Hands that touch the arm."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tactful.control import minimum_jerk

Array = NDArray[np.float64]

_DERIVATIVE_S = 0.001


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

    def acts(self, t: float) -> bool:
        """Return whether it touches at the time t [s]."""
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
class Tremor:
    """What trembles in a force: one sinusoid an axis.

    Attributes:
        amplitude_n: (3,) [N].
        frequency_hz: (3,) [Hz]; a hand's physiological tremor lies at 8 to 12 Hz.
        phase_rad: (3,) [rad].
    """

    amplitude_n: tuple[float, float, float]
    frequency_hz: tuple[float, float, float]
    phase_rad: tuple[float, float, float]

    def force(self, t: float) -> Array:
        """Return the force (3,) at the time t [s], base axes [N]."""
        phase = 2 * np.pi * t * np.array(self.frequency_hz) + self.phase_rad
        return np.asarray(self.amplitude_n * np.sin(phase))


@dataclass(frozen=True, kw_only=True)
class Hesitation:
    """A pause in the rise of a touch.

    Attributes:
        share: the share of the full action at which the hand pauses.
        pause_s: for how long [s].
    """

    share: float
    pause_s: float


@dataclass(frozen=True, kw_only=True)
class _Touch:
    """When a hand touches, and where.

    Attributes:
        link: name of the link.
        point_m: (3,) the point in the link's frame [m].
        start_s: when it touches first [s].
        rise_s: time until it acts fully, without a pause [s].
        hold_s: time for which it does [s].
        fall_s: time in which it lets go [s].
        hesitation: a pause in the rise, which is then split in two; none by default.
        tremor: what trembles in its force; nothing by default.
    """

    link: str
    point_m: tuple[float, float, float] = (0.0, 0.0, 0.0)
    start_s: float
    rise_s: float = 0.12
    hold_s: float
    fall_s: float = 0.2
    hesitation: Hesitation | None = None
    tremor: Tremor | None = None

    @property
    def end_s(self) -> float:
        """When it has let go [s]."""
        pause = self.hesitation.pause_s if self.hesitation else 0.0
        return self.start_s + self.rise_s + pause + self.hold_s + self.fall_s

    def acts(self, t: float) -> bool:
        """Return whether it touches at the time t [s]."""
        return self.start_s < t < self.end_s

    def grip(self, t: float) -> float:
        """Return the share of the hand's full action at the time t [s]: minimum-jerk rise and fall."""
        falling = t - (self.end_s - self.fall_s)
        if falling >= 0:
            return 1.0 - minimum_jerk(falling / self.fall_s)
        since = t - self.start_s
        if self.hesitation is None:
            return minimum_jerk(since / self.rise_s)
        share, half = self.hesitation.share, self.rise_s / 2
        again = since - half - self.hesitation.pause_s
        return share * minimum_jerk(since / half) + (1.0 - share) * minimum_jerk(again / half)

    def _trembling(self, t: float, force: Array) -> Array:
        return force if self.tremor is None else force + self.tremor.force(t)


@dataclass(frozen=True, kw_only=True)
class Push(_Touch):
    """A hand that pushes with a given force, however the arm moves.

    Attributes:
        force_n: (3,) the force, base axes [N].
    """

    force_n: tuple[float, float, float]

    def force(self, t: float, position_m: Array, velocity_m_s: Array) -> Array:
        """Return the force on the link (3,), base axes [N]."""
        return self.grip(t) * self._trembling(t, np.array(self.force_n))


def _drawn(hand: Guide | Drag | Lead, target_m: ArrayLike, position_m: Array, velocity_m_s: Array) -> Array:
    """Return the force of a spring of bounded strength and a damper (3,) [N]."""
    spring = hand.stiffness_n_m * (np.asarray(target_m) - position_m)
    spring *= min(1.0, hand.strength_n / max(float(np.linalg.norm(spring)), 1e-9))
    return np.asarray(spring - hand.damping_ns_m * velocity_m_s)


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
        return np.asarray(self.grip(t) * self._trembling(t, _drawn(self, self.target_m, position_m, velocity_m_s)))


@dataclass(kw_only=True)
class Drag:
    """A hand that holds a point of a link and draws it after itself, as long as it has a target.

    F = K (target - x) - D dx/dt, with the spring's part at most `strength_n`.

    Attributes:
        link: name of the link.
        point_m: (3,) the point in the link's frame [m].
        target_m: (3,) where the hand is, in the base [m]; None while it does not touch. It may change at any time.
        stiffness_n_m: K [N/m].
        damping_ns_m: D [Ns/m].
        strength_n: largest force of the spring [N].
    """

    link: str
    point_m: tuple[float, float, float] = (0.0, 0.0, 0.0)
    target_m: tuple[float, float, float] | None = None
    stiffness_n_m: float = 300.0
    damping_ns_m: float = 8.0
    strength_n: float = 30.0

    def acts(self, t: float) -> bool:
        """Return whether it touches."""
        return self.target_m is not None

    def force(self, t: float, position_m: Array, velocity_m_s: Array) -> Array:
        """Return the force on the link (3,), base axes [N]."""
        if self.target_m is None:
            return np.zeros(3)
        return _drawn(self, self.target_m, position_m, velocity_m_s)


@dataclass(frozen=True, kw_only=True)
class Lead(_Touch):
    """A hand that takes hold of a point and leads it along a path, as a spring and a damper.

    F = grip(t) (K (x_d(t) - x) + D (dx_d/dt - dx/dt)), with the spring's part at most `strength_n`.

    Attributes:
        path: where the point is to be at the time t, in the base (3,) [m].
        stiffness_n_m: K [N/m].
        damping_ns_m: D [Ns/m].
        strength_n: largest force of the spring [N].
    """

    path: Callable[[float], Array]
    stiffness_n_m: float = 400.0
    damping_ns_m: float = 15.0
    strength_n: float = 20.0

    def force(self, t: float, position_m: Array, velocity_m_s: Array) -> Array:
        """Return the force on the link (3,), base axes [N]."""
        target = self.path(t)
        target_m_s = (target - self.path(t - _DERIVATIVE_S)) / _DERIVATIVE_S
        force = _drawn(self, target, position_m, velocity_m_s - target_m_s)
        return np.asarray(self.grip(t) * self._trembling(t, force))
