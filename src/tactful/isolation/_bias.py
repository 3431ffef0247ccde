"""The bias of the external torque, followed while nothing touches."""

from __future__ import annotations

from collections import deque

import numpy as np
from numpy.typing import ArrayLike

from tactful.isolation._location import Array, IsolationError


class BiasTracker:
    r"""Subtract the bias of tau_ext: its mean while nothing touches, kept as it is while something does.

    After a contact the joints do not return to where they were (hysteresis, 0.06 to 0.2 Nm on a Panda at rest), so the
    mean starts anew there: with k samples since then, at steps of dt,

        b <- b + max(1 / k, dt / time_constant) (tau_ext - b).

    A sample counts only when no contact has begun within `guard_s` after it, so that the rise of a contact before its
    detection is not taken for bias.

    Args:
        n: number of joints.
        time_constant_s: of the mean [s].
        guard_s: how much later a contact may be detected than it begins [s].
        limit_nm: bound on the bias of a joint; beyond, it is taken for something else [Nm].
    """

    def __init__(self, n: int, *, time_constant_s: float = 0.5, guard_s: float = 0.05, limit_nm: float = 1.0) -> None:
        for name, value in (("time_constant_s", time_constant_s), ("limit_nm", limit_nm)):
            if not value > 0:
                raise IsolationError(name, f"must be positive, not {value}")
        self.time_constant_s, self.guard_s, self.limit_nm = time_constant_s, guard_s, limit_nm
        self._mean = np.zeros(n)
        self._pending: deque[tuple[float, Array]] = deque()
        self._count = 0
        self._last_s = np.nan
        self._frozen = False

    @property
    def bias(self) -> Array:
        """The bias (n,) [Nm]."""
        return np.clip(self._mean, -self.limit_nm, self.limit_nm)

    @property
    def frozen(self) -> bool:
        """Whether a contact keeps it from being followed."""
        return self._frozen

    @property
    def at_limit(self) -> bool:
        """Whether the bias of a joint has reached its bound: then it is not a bias."""
        return bool((np.abs(self._mean) >= self.limit_nm).any())

    def update(self, t: float, tau_ext: ArrayLike, contact: bool) -> Array:
        """Take one sample and return the torque without its bias (n,) [Nm].

        Args:
            t: time [s].
            tau_ext: (n,) [Nm].
            contact: whether something touches, as far as is known now.

        Raises:
            IsolationError: if the torque has a wrong length or is not finite.
        """
        torque = np.array(tau_ext, dtype=np.float64)
        if torque.shape != self._mean.shape:
            raise IsolationError("tau_ext", f"has shape {torque.shape}; the tracker was made for {self._mean.shape}")
        if not np.isfinite(torque).all():
            raise IsolationError("tau_ext", "has numbers that are not finite: skip this sample")
        if contact:
            self._pending.clear()
            self._count = 0
        else:
            self._pending.append((t, torque))
            while self._pending and self._pending[0][0] <= t - self.guard_s:
                self._take(*self._pending.popleft())
        self._frozen = contact
        return torque - self.bias

    def _take(self, t: float, torque: Array) -> None:
        self._count += 1
        step = 0.0 if self._count == 1 else max(t - self._last_s, 0.0)
        self._last_s = t
        self._mean += min(max(1.0 / self._count, step / self.time_constant_s), 1.0) * (torque - self._mean)
