"""The evidence at the beginning of a contact."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tactful.isolation import ContactLocation

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False, kw_only=True)
class Onset:
    """What is known of a contact at the moment of its detection: the samples before it, the last one included.

    Attributes:
        rate_hz: sampling rate [Hz].
        t: times (k,) [s].
        force_n: external force at the tip (k, 3), base axes [N].
        moment_nm: external moment about the tip (k, 3), base axes [Nm].
        velocity_m_s: velocity of the tip (k, 3), base axes [m/s]; None if the recording has none.
        tau_ext_nm: external joint torque (k, n) [Nm]; None where only a wrench is known.
        index: the sample at which the contact began, from the backward search.
        directions: which of x, y and z were detected (3,).
        in_collision: whether another contact, a collision, was there already.
        after_collision: whether one was there in the last second.
        torque_change_nm: change of the external torque (n,), or wrench, that the fast detector saw; None in paper mode.
        mean_force_change_n: the force (3,) at the tip that it means, base axes [N]; None in paper mode.
        torque_covariance_nm2: covariance (n, n) of the noise in `torque_change_nm` [Nm^2]; None in paper mode.
        detected_s: when the contact was detected, on the clock of `t` [s]; None: at the last sample.
        next_s: when the classifier is asked again if it says `contact` [s]; None if it is not.
        q_rad: joint positions (k, n) [rad]; None where they are not recorded.
        jacobian: of the tip at the last sample (6, n), linear above angular, base axes; None without positions.
        mass_matrix: M at the last sample (n, n); None without positions.
        collision_torque_nm: external torque (n,) of the collision that is there [Nm]; None without one.
        collision_s: when that collision began [s]; None without one.
        location: where on the arm the contact is; None where that is not looked for.
    """

    rate_hz: float
    t: Array
    force_n: Array
    moment_nm: Array
    velocity_m_s: Array | None
    tau_ext_nm: Array | None
    index: int
    directions: NDArray[np.bool_]
    in_collision: bool
    after_collision: bool = False
    torque_change_nm: Array | None = None
    mean_force_change_n: Array | None = None
    torque_covariance_nm2: Array | None = None
    detected_s: float | None = None
    next_s: float | None = None
    q_rad: Array | None = None
    jacobian: Array | None = None
    mass_matrix: Array | None = None
    collision_torque_nm: Array | None = None
    collision_s: float | None = None
    location: ContactLocation | None = None

    def force_change_n(self, secant_s: float) -> Array:
        """Return the change of the force (3,) [N] from the onset over `secant_s`, at least over one sample.

        In fast mode it is the one that the detector saw, whose window it chose itself.
        """
        if self.mean_force_change_n is not None:
            return self.mean_force_change_n
        ahead = max(1, round(secant_s * self.rate_hz))
        last = len(self.t) - 1
        start = min(self.index, last - 1)
        return self.force_n[min(start + ahead, last)] - self.force_n[start]  # type: ignore[no-any-return]

    def velocity_before_m_s(self, average_s: float) -> Array | None:
        """Return the mean velocity (3,) over the time `average_s` that ends at the onset, at least one sample."""
        if self.velocity_m_s is None:
            return None
        count = max(1, round(average_s * self.rate_hz))
        return np.asarray(self.velocity_m_s[max(0, self.index + 1 - count) : self.index + 1].mean(axis=0))
