"""Sensors of a simulation that are as noisy as those of a recording."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import nnls
from scipy.signal import butter, sosfiltfilt

from tactful.calibration._calibrate import calibrate
from tactful.calibration._errors import CalibrationError
from tactful.monitor import MonitorConfig
from tactful.recordings import Recording
from tactful.simulation import NoiseSpectrum, SensorConfig

Array = NDArray[np.float64]

_ABOVE_HZ = 8.0
"""Motion is slower, noise that is told from it faster [Hz]."""
_LAGS = 24
_HARMONICS = (1, 2, 4)
_LOOSE = 5.0
"""How far the ripple's periods in one turn may lie from the gear's: its torsion shifts them."""
_SHORTEST_S = 5.0
_SPEEDS = 6
"""Classes of speed."""


def fit_sensors(recording: Recording, config: MonitorConfig, gear_ratio: Array) -> SensorConfig:
    r"""Return sensors that make the truth as noisy as a recording of free motion is.

    Of velocity and torque above 8 Hz, the torque is first relieved of the gear's ripple,
    sum_h a_h sin(h N q + \phi_h) with the harmonics h = 1, 2 and 4 of the gear ratio N. The standard deviation of what
    is left is a line over the joint's speed; divided by it, both signals of a joint are taken as one autoregressive
    process of order 24. Offset and dry friction are those that a calibration finds; of the stamps, the spread about the
    nearest even ones, and how many rows repeat the one before.

    Args:
        recording: free motion, with q, dq and tau at about 1 kHz.
        config: names the arm.
        gear_ratio: turns of each motor in one turn of its joint (n,).

    Raises:
        CalibrationError: if the recording lacks a channel, is too short, or its rate is not 1 kHz.
    """
    source = recording.source or "recording"
    if abs(recording.rate_hz / 1000 - 1) > 0.1:
        raise CalibrationError(source, f"sampled at {recording.rate_hz:.4g} Hz: noise is modelled at 1 kHz")
    observer = calibrate([recording], config).config.observer
    signals = [recording.channels[name] for name in ("q", "dq", "tau")]
    same = np.append(False, np.all([(np.diff(x, axis=0) == 0).all(axis=1) for x in signals], axis=0))
    q, dq, tau = (x[~same] for x in signals)
    if len(q) < 1000 * _SHORTEST_S:
        raise CalibrationError(source, f"holds {len(q)} different samples: noise needs {_SHORTEST_S:g} s at 1 kHz")
    high = butter(4, _ABOVE_HZ, "highpass", fs=1000, output="sos")
    moving = np.arange(len(q)) > np.argmax(np.abs(dq).max(axis=1) > 0.05) + 500
    velocity, torque = (sosfiltfilt(high, x, axis=0)[moving] for x in (dq, tau))  # (k, n)
    n = q.shape[1]
    q, speed = q[moving], np.abs(dq[moving])
    amplitude, order = np.zeros((2, len(_HARMONICS), n))
    for i in range(n):
        torque[:, i], amplitude[:, i], order[:, i] = _without_ripple(torque[:, i], q[:, i], gear_ratio[i])
    dq_base, dq_growth = _by_speed(velocity, speed)
    tau_base, tau_growth = _by_speed(torque, speed)
    units = np.stack([velocity / (dq_base + dq_growth * speed), torque / (tau_base + tau_growth * speed)])  # (2, k, n)
    offset = np.abs(np.broadcast_to(observer.bias_nm, n))
    even = np.polyval(np.polyfit(np.arange(len(same)), recording.t, 1), np.arange(len(same)))
    wander = recording.t - even  # the host's clock wanders, which is no jitter
    jitter = np.diff(wander).std() / np.sqrt(2)
    return SensorConfig(
        encoder_step_rad=1e-6,
        velocity_noise_rad_s=_tuple(dq_base),
        velocity_noise_growth=_tuple(dq_growth),
        torque_noise_nm=_tuple(tau_base),
        torque_noise_growth=_tuple(tau_growth),
        spectrum=tuple(_spectrum(units[:, :, i]) for i in range(n)),
        ripple_nm=tuple(_tuple(row) for row in amplitude),
        ripple_per_turn=tuple(_tuple(row) for row in order),
        coulomb_nm=_tuple(np.broadcast_to(observer.coulomb_nm, n)),
        hysteresis_rad=_tuple(np.broadcast_to(observer.hysteresis_rad, n)),
        torque_offset_nm=_tuple(offset),
        stamp_jitter_s=float(f"{jitter:.3g}"),
        repeated_rows=float(f"{same.mean():.3g}"),
        provenance=f"fit_sensors() on {Path(source).name}, {len(q)} samples",
    )


def _by_speed(x: Array, speed: Array) -> tuple[Array, Array]:
    """Return the standard deviation at rest (n,) and its growth with the speed (n,), from classes of speed."""
    base, growth = np.zeros((2, x.shape[1]))
    for i in range(x.shape[1]):
        groups = np.array_split(np.argsort(speed[:, i]), _SPEEDS)
        mean = np.array([[1.0, speed[group, i].mean()] for group in groups])  # (c, 2)
        (base[i], growth[i]), _ = nnls(mean, np.array([x[group, i].std() for group in groups]))
    return base, growth


def _without_ripple(x: Array, q: Array, ratio: float) -> tuple[Array, Array, Array]:
    """Return a torque (k,) without the gear's ripple, whose amplitudes and periods in one turn follow."""
    orders = []
    for harmonic in _HARMONICS:
        near = harmonic * ratio + np.arange(-_LOOSE, _LOOSE + 0.1, 0.25)
        orders.append(near[np.argmax(np.abs(np.exp(-1j * np.outer(near, q)) @ x))])
    waves = np.concatenate([np.cos(np.outer(q, orders)), np.sin(np.outer(q, orders))], axis=1)  # (k, 2 h)
    found = np.linalg.lstsq(waves, x, rcond=None)[0]
    return x - waves @ found, np.hypot(*found.reshape(2, -1)), np.array(orders)


def _spectrum(x: Array) -> NoiseSpectrum:
    """Return the autoregressive process of velocity and torque (2, k), scaled to unit variance."""
    x = x / x.std(axis=1, keepdims=True)
    past = np.concatenate([x[:, _LAGS - lag : -lag] for lag in range(1, _LAGS + 1)])  # (2 l, k - l)
    now = x[:, _LAGS:]
    A = now @ past.T @ np.linalg.inv(past @ past.T + 1e-6 * past.shape[1] * np.eye(len(past)))  # (2, 2 l)
    left = now - A @ past
    L = np.linalg.cholesky(left @ left.T / left.shape[1])
    lags = A.reshape(2, _LAGS, 2).transpose(1, 0, 2).reshape(_LAGS, 4)
    return NoiseSpectrum(
        lags=tuple(tuple(float(f"{a:.4g}") for a in lag) for lag in lags),
        innovation=tuple(float(f"{a:.4g}") for a in (L[0, 0], L[1, 0], L[1, 1])),
    )


def _tuple(values: Array) -> tuple[float, ...]:
    return tuple(float(f"{value:.3g}") for value in values)
