"""What the beginning of a contact looks like in numbers: physical features of an onset."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from tactful.classification._onset import Onset

Array = NDArray[np.float64]

_SLOPE_S = 0.02
"""Time over which the joint velocity is the slope of the positions [s]."""
_STEP_S, _AHEAD_S = 0.02, 0.05
"""Time over which the steepest rise is taken, and from how long before the onset on [s]."""
_FLOOR = 0.02
"""Speed in the metric of the inertia below which the direction of the motion fades [m/s sqrt(kg)]."""
_PRIOR = np.array([20.0, 20.0, 20.0, 4.0, 4.0, 4.0]) ** 2
"""Variance of the wrench of a touch at the tip [N^2, (Nm)^2]."""


class Change:
    r"""The change of the external torque at an onset, y, beside the motion.

    y is what the fast detector saw over its best window, beyond what was there before, V the covariance of its noise.
    Velocities are slopes of the joint positions over 20 ms: before the onset (dq) and at the end.
    Inner products of torques are taken in V^-1 (how clearly does it stand out of the noise) and M^-1 (what would it do
    to the motion).

    Args:
        onset: with positions and the change of the torque.
    """

    def __init__(self, onset: Onset) -> None:
        assert onset.torque_change_nm is not None
        assert onset.torque_covariance_nm2 is not None
        assert onset.jacobian is not None
        assert onset.mass_matrix is not None
        self.onset = onset
        self.y: Array = onset.torque_change_nm  # (n,)
        self.J: Array = onset.jacobian  # (6, n)
        self.M: Array = onset.mass_matrix  # (n, n)
        self.V: Array = onset.torque_covariance_nm2  # (n, n)
        self.before: Array = self._slope(onset.index)  # (n,)
        self.after: Array = self._slope(len(onset.t) - 1)

    def _slope(self, last: int) -> Array:
        """Return the joint velocity (n,) before the sample `last` [rad/s]."""
        onset = self.onset
        assert onset.q_rad is not None
        count = max(2, round(_SLOPE_S * onset.rate_hz))
        rows = slice(max(0, last + 1 - count), max(last + 1, 2))
        t = onset.t[rows] - onset.t[rows].mean()
        return np.asarray(t @ onset.q_rad[rows] / max(float(t @ t), 1e-12))

    @cached_property
    def significance(self) -> float:
        """y^T V^-1 y."""
        return float(self.y @ np.linalg.solve(self.V, self.y))

    @cached_property
    def wrench(self) -> Array:
        """The wrench (6,) at the tip that y means, by the prior on a touch [N, Nm]."""
        PJ = _PRIOR[:, None] * self.J
        return np.asarray(PJ @ np.linalg.solve(self.J.T @ PJ + self.V, self.y))

    @cached_property
    def force(self) -> float:
        """The magnitude of its force [N]."""
        return float(np.linalg.norm(self.wrench[:3]))

    @cached_property
    def inertial(self) -> float:
        """sqrt(y^T M^-1 y)."""
        return math.sqrt(max(float(self.y @ np.linalg.solve(self.M, self.y)), 1e-12))

    @cached_property
    def size(self) -> Array:
        """The torque along y in V^-1, in shares of y, from 50 ms before the onset on (k,)."""
        assert self.onset.tau_ext_nm is not None
        begin = max(0, self.onset.index - round(_AHEAD_S * self.onset.rate_hz))
        weight = np.linalg.solve(self.V, self.y) / max(self.significance, 1e-12)
        return np.asarray(self.onset.tau_ext_nm[begin:] @ weight)

    @cached_property
    def steepest(self) -> float:
        """The largest change of the size within 20 ms."""
        step = max(1, round(_STEP_S * self.onset.rate_hz))
        size = self.size
        return float(np.max(np.abs(size[step:] - size[:-step]))) if len(size) > step else abs(float(size[-1] - size[0]))

    def speed(self, dq: Array) -> float:
        """sqrt(dq^T M dq) [m/s sqrt(kg)]."""
        return math.sqrt(max(float(dq @ self.M @ dq), 0.0))

    def along(self, dq: Array) -> float:
        """How fast the arm moves with the force, y^T dq / sqrt(y^T M^-1 y) [m/s sqrt(kg)]."""
        return float(self.y @ dq) / self.inertial

    def unexplained(self, rows: int) -> float:
        """Return the share of y that no force (3 rows) or wrench (6) at the tip explains, beyond the noise."""
        A = self.J[:rows]  # (r, n)
        VA = np.linalg.solve(self.V, A.T)  # (n, r)
        gram = A @ VA
        gram[np.diag_indices_from(gram)] += 1 / _PRIOR[:rows]
        rest = self.significance - float(self.y @ VA @ np.linalg.solve(gram, VA.T @ self.y))
        noise = max(len(self.y) - rows, 0)
        return max(rest - noise, 0.0) / max(self.significance - noise, 1e-9)


def _against(change: Change) -> float:
    v = change.J[:3] @ change.before
    return float(change.wrench[:3] @ v) / (max(change.force, 1e-9) * math.hypot(float(np.linalg.norm(v)), 0.01))


def _power(change: Change) -> float:
    return change.along(change.before) / math.hypot(change.speed(change.before), _FLOOR)


def _power_after(change: Change) -> float:
    return change.along(change.after) / math.hypot(change.speed(change.after), _FLOOR)


def _with_force(change: Change) -> float:
    return math.asinh(change.along(change.after) / _FLOOR)


def _turned(change: Change) -> float:
    return math.asinh((change.along(change.after) - change.along(change.before)) / _FLOOR)


def _abrupt(change: Change) -> float:
    return change.steepest / max(float(np.max(np.abs(change.size - change.size[0]))), 1e-9)


def _rate(change: Change) -> float:
    return math.log10(max(change.steepest * change.force / _STEP_S, 1.0))


def _lever(change: Change) -> float:
    return math.log10(max(float(np.linalg.norm(change.wrench[3:])), 1e-3) / max(change.force, 1e-3))


def _not_a_force(change: Change) -> float:
    return change.unexplained(3)


def _not_a_wrench(change: Change) -> float:
    return change.unexplained(6)


def _from_tip(change: Change) -> float:
    location = change.onset.location
    if location is None:
        return math.nan
    p = location.link_probabilities
    return float(p @ np.arange(len(p) - 1, -1, -1))


def _along_collision(change: Change) -> float:
    known = change.onset.collision_torque_nm
    if known is None or not known.any():
        return math.nan
    Vk = np.linalg.solve(change.V, known)
    return float(Vk @ change.y) / math.sqrt(max(float(Vk @ known) * change.significance, 1e-12))


def _beside_collision(change: Change) -> float:
    known = change.onset.collision_torque_nm
    if known is None or not known.any():
        return math.nan
    return 0.5 * math.log10(change.significance / max(float(known @ np.linalg.solve(change.V, known)), 1e-9))


def _with_force_beside(change: Change) -> float:
    known = change.onset.collision_torque_nm
    if known is None or not known.any():
        return math.nan
    Vk = np.linalg.solve(change.V, known)
    beside = change.y - float(Vk @ change.y) / max(float(Vk @ known), 1e-12) * known
    return math.asinh(float(beside @ change.after) / change.inertial / _FLOOR)


def _since_collision(change: Change) -> float:
    onset = change.onset
    if onset.collision_s is None:
        return math.nan
    return math.log10(max(float(onset.t[onset.index]) - onset.collision_s, 0.01))


def _same(value: float) -> float:
    return value


def _power_of_ten(value: float) -> float:
    return 10.0**value  # type: ignore[no-any-return]


def _milliseconds(value: float) -> float:
    return 1e3 * _power_of_ten(value)


def _percent(value: float) -> float:
    return 100 * value


def _speed_of(value: float) -> float:
    return _FLOOR * math.sinh(value)


@dataclass(frozen=True)
class Feature:
    """A number that says something of a contact.

    Attributes:
        of: what computes it; nan where it is not known.
        words: it in words, with `shown` of it in braces.
        shown: from the feature to what people read.
        location: whether it says where on the arm the contact is.
    """

    of: Callable[[Change], float]
    words: str
    shown: Callable[[float], float] = _same
    location: bool = False

    def text(self, value: float) -> str:
        """Return it in words."""
        return self.words.format(self.shown(value))


FEATURES: dict[str, Feature] = {
    "against_motion": Feature(_against, "the force at the tip is {:+.2f} along its motion (-1 against, 1 with it)"),
    "power": Feature(_power, "the torque is {:+.2f} along the motion of the joints (-1 against, 1 with it)"),
    "power_after": Feature(_power_after, "the torque is {:+.2f} along the motion that followed"),
    "with_force": Feature(_with_force, "the arm then moves with the force by {:+.2f} m/s sqrt(kg)", _speed_of),
    "turned": Feature(_turned, "the force changed the motion by {:+.2f} m/s sqrt(kg)", _speed_of),
    "abrupt": Feature(_abrupt, "{:.0f} % of the change came within 20 ms", _percent),
    "rate": Feature(_rate, "the force rose by up to {:.0f} N/s", _power_of_ten),
    "lever": Feature(_lever, "the lever arm about the tip is {:.2f} m", _power_of_ten, location=True),
    "not_a_force": Feature(_not_a_force, "no force at the tip explains {:.0f} % of it", _percent, location=True),
    "not_a_wrench": Feature(_not_a_wrench, "no wrench at the tip explains {:.0f} % of it", _percent, location=True),
    "from_tip": Feature(_from_tip, "the contact is {:.1f} links from the tip", location=True),
    "along_collision": Feature(_along_collision, "the torque is {:+.2f} along that of the collision"),
    "beside_collision": Feature(_beside_collision, "the torque is {:.2f} of that of the collision", _power_of_ten),
    "with_force_beside": Feature(
        _with_force_beside, "the arm then moves by {:+.2f} m/s sqrt(kg) with what is not of the collision", _speed_of
    ),
    "since_collision": Feature(_since_collision, "the collision began {:.0f} ms before", _milliseconds),
}


def measured(onset: Onset, names: Sequence[str]) -> Array | None:
    """Return the features (k,) of an onset, nan where one is not known; None if the onset does not tell enough."""
    needs = (onset.torque_change_nm, onset.torque_covariance_nm2, onset.jacobian, onset.mass_matrix, onset.q_rad)
    if onset.tau_ext_nm is None or any(value is None for value in needs):
        return None
    change = Change(onset)
    return np.array([FEATURES[name].of(change) for name in names])
