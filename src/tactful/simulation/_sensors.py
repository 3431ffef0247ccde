"""From the truth to what the sensors of an arm say."""

from __future__ import annotations

import functools
import math

import numpy as np
from numpy.typing import NDArray

from tactful.errors import TactfulError
from tactful.simulation._config import NoiseSpectrum, PerJoint, SensorConfig

Array = NDArray[np.float64]

_BLOCK = 2048
_MEMORY = 512
"""Samples after which noise has been forgotten."""
_COULOMB_RAD_S = 0.02


class Sensors:
    """The encoders and torque sensors of an arm with n joints.

    Args:
        n: number of joints.
        config: the settings.
        rng: where noise comes from.
        period_s: time between two samples [s].
        arm_rng: where the phases of the ripple and the offsets come from, which stay with an arm; by default `rng`.

    Raises:
        TactfulError: if a setting has another number of joints.
    """

    def __init__(
        self,
        n: int,
        config: SensorConfig,
        rng: np.random.Generator,
        period_s: float,
        arm_rng: np.random.Generator | None = None,
    ) -> None:
        arm_rng = rng if arm_rng is None else arm_rng
        self._config = config
        self._rng = rng
        self._period_s = period_s
        self._offset = _each(config.torque_offset_nm, n, "torque_offset_nm") * arm_rng.standard_normal(n)
        self._noise = Noise(n, config.spectrum, rng)
        base, growth = config.velocity_noise_rad_s, config.velocity_noise_growth
        self._dq_noise = _each(base, n, "velocity_noise_rad_s"), _each(growth, n, "velocity_noise_growth")
        base, growth = config.torque_noise_nm, config.torque_noise_growth
        self._tau_noise = _each(base, n, "torque_noise_nm"), _each(growth, n, "torque_noise_growth")
        self._noisy = any(x.any() for x in (*self._dq_noise, *self._tau_noise))
        self._coulomb = _each(config.coulomb_nm, n, "coulomb_nm")
        self._hysteresis = _each(config.hysteresis_rad, n, "hysteresis_rad")
        self._rubs = bool(self._coulomb.any())
        self._friction = np.zeros(n)
        self._ripple = np.array([_each(a, n, "ripple_nm") for a in config.ripple_nm]).reshape(-1, n)  # (h, n)
        self._order = np.array([_each(a, n, "ripple_per_turn") for a in config.ripple_per_turn]).reshape(-1, n)
        self._phase = arm_rng.uniform(0, 2 * np.pi, self._ripple.shape)
        self._smooth = (
            -math.expm1(-2 * np.pi * config.velocity_cutoff_hz * period_s) if config.velocity_cutoff_hz else 1.0
        )
        self._before: Array | None = None
        self._velocity = np.zeros(n)
        self._now = np.zeros((2, n))
        self._true = np.zeros((2, n))

    def motion(self, q: Array, dq: Array) -> tuple[Array, Array]:
        """Return the measured positions (n,) [rad] and velocities (n,) [rad/s], once for every sample."""
        step = self._config.encoder_step_rad
        measured = step * np.round(q / step) if step else q.copy()
        if self._config.velocity == "exact":
            velocity = dq.copy()
        else:
            velocity = np.zeros_like(dq) if self._before is None else (measured - self._before) / self._period_s
        if self._smooth < 1.0:
            velocity = velocity if self._before is None else self._velocity + self._smooth * (velocity - self._velocity)
            self._velocity = velocity
        self._before = measured
        self._true = np.array([q, dq])
        if self._noisy:
            self._now = self._noise.next()
            base, growth = self._dq_noise
            velocity = velocity + (base + growth * np.abs(dq)) * self._now[0]
        return measured, velocity

    def torque(self, tau: Array) -> Array:
        """Return the measured torque (n,) [Nm] at the motion that was measured last."""
        q, dq = self._true
        measured = tau + self._offset
        if self._noisy:
            base, growth = self._tau_noise
            measured += (base + growth * np.abs(dq)) * self._now[1]
        if len(self._ripple):
            measured += np.add.reduce(self._ripple * np.sin(self._order * q + self._phase))
        if self._rubs:
            slide = self._period_s * dq / np.maximum(self._hysteresis, 1e-12)
            taken_up = (self._friction + slide) / (1.0 + np.abs(slide))
            self._friction = np.where(self._hysteresis > 0, taken_up, np.tanh(dq / _COULOMB_RAD_S))
            measured += self._coulomb * self._friction
        return measured

    def stamps(self, t: Array) -> tuple[Array, NDArray[np.intp]]:
        """Return the time stamps of the rows of a log (N,) [s], and which sample each row holds (N,).

        Args:
            t: when the samples were taken (N,) [s].
        """
        config, rng = self._config, self._rng
        rows = np.arange(len(t))
        stamps = t.copy()
        if config.stamp_jitter_s:
            stamps = np.maximum.accumulate(t + config.stamp_jitter_s * rng.standard_normal(len(t)))
        if config.repeated_rows:
            late = rng.uniform(size=len(t)) < config.repeated_rows
            late[0] = False
            rows[late] -= 1
        return stamps, rows


class Noise:
    """Noise of unit variance for velocity and torque.

    Args:
        n: number of joints.
        spectrum: one a joint, or none for white noise.
        rng: its source.

    Raises:
        TactfulError: if there is another number of spectra.
    """

    def __init__(self, n: int, spectrum: tuple[NoiseSpectrum, ...], rng: np.random.Generator) -> None:
        if spectrum and len(spectrum) != n:
            raise TactfulError(f"the sensors have {len(spectrum)} spectra, but the arm has {n} joints")
        self._n, self._rng = n, rng
        self._response = np.stack([impulse_response(joint) for joint in spectrum], axis=-1) if spectrum else None
        self._white = rng.standard_normal((_MEMORY, 2, n)) if spectrum else None
        self._block = np.empty((0, 2, n))
        self._next = 0

    def next(self) -> Array:
        """Return the noise of the next sample (2, n): of the velocities and of the torques."""
        if self._next == len(self._block):
            self._block, self._next = self._draw(), 0
        self._next += 1
        return np.asarray(self._block[self._next - 1])

    def _draw(self) -> Array:
        fresh = self._rng.standard_normal((_BLOCK, 2, self._n))
        if self._response is None or self._white is None:
            return fresh
        from scipy.signal import fftconvolve

        white = np.concatenate([self._white, fresh])  # (m + b, 2, n)
        self._white = white[-_MEMORY:]
        parts = fftconvolve(white[:, None], self._response, axes=0)[_MEMORY : _MEMORY + _BLOCK]  # (b, 2, 2, n)
        return np.asarray(parts.sum(axis=2))


@functools.cache
def impulse_response(spectrum: NoiseSpectrum) -> Array:
    """Return what one unit of white noise does to velocity and torque, sample by sample (m, 2, 2)."""
    A = np.array(spectrum.lags).reshape(-1, 2, 2)
    a, b, c = spectrum.innovation
    response = np.zeros((_MEMORY, 2, 2))
    response[0] = [[a, 0.0], [b, c]]
    for k in range(1, _MEMORY):
        for lag in range(1, min(k, len(A)) + 1):
            response[k] += A[lag - 1] @ response[k - lag]
    return response


def _each(value: PerJoint, n: int, name: str) -> Array:
    figures = np.array(value, dtype=np.float64)
    if figures.ndim and len(figures) != n:
        raise TactfulError(f"sensors, {name}: has {len(figures)} figures, but the arm has {n} joints")
    return np.broadcast_to(figures, n)
