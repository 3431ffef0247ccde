"""From the truth to what the sensors of an arm say."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tactful.simulation._config import SensorConfig

Array = NDArray[np.float64]


class Sensors:
    """The encoders and torque sensors of an arm with n joints.

    Args:
        n: number of joints.
        config: the settings.
        rng: where noise and offsets come from.
        period_s: time between two samples [s].
    """

    def __init__(self, n: int, config: SensorConfig, rng: np.random.Generator, period_s: float) -> None:
        self._config = config
        self._rng = rng
        self._period_s = period_s
        self._offset = config.torque_offset_nm * rng.standard_normal(n)
        self._before: Array | None = None

    def motion(self, q: Array, dq: Array) -> tuple[Array, Array]:
        """Return the measured positions (n,) [rad] and velocities (n,) [rad/s], once for every sample."""
        step = self._config.encoder_step_rad
        measured = step * np.round(q / step) if step else q.copy()
        if self._config.velocity == "exact":
            return measured, dq.copy()
        before = measured if self._before is None else self._before
        self._before = measured
        return measured, (measured - before) / self._period_s

    def torque(self, tau: Array) -> Array:
        """Return the measured torque (n,) [Nm], once for every sample."""
        noise = self._config.torque_noise_nm
        return tau + self._offset + (noise * self._rng.standard_normal(len(tau)) if noise else 0.0)
