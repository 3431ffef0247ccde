"""Simulated sensors against those of a real arm, and the models that they are made of."""

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.signal import butter, sosfiltfilt, welch

from tactful.config import ConfigError
from tactful.errors import TactfulError
from tactful.recordings import Recording
from tactful.simulation import NoiseSpectrum, SensorConfig
from tactful.simulation._sensors import Noise, Sensors, impulse_response

LOG = Path(__file__).parents[3] / "shared" / "data" / "panda_free_motion" / "exciting_first_10s.csv"
Array = NDArray[np.float64]


def above_8_hz(x: Array) -> Array:
    """Return what is no motion."""
    return sosfiltfilt(butter(4, 8, "highpass", fs=1000, output="sos"), x, axis=0)[1500:]


@pytest.mark.skipif(not LOG.is_file(), reason=f"there is no {LOG.name} beside the checkout")
def test_preset_is_as_noisy_as_the_real_arm() -> None:
    """Every rate for a noisy arm rests on this preset: level, spectrum and correlation have to be those of the log."""
    log = Recording.read(LOG)
    fresh = np.append(True, (np.diff(log.dq, axis=0) != 0).any(axis=1))
    q, dq, tau = log.q[fresh], log.dq[fresh], log.tau[fresh]
    slow = butter(4, 6, fs=1000, output="sos")
    true_q, true_dq = (sosfiltfilt(slow, x, axis=0) for x in (q, dq))
    sensors = Sensors(7, SensorConfig.preset("panda"), np.random.default_rng(1), 0.001)
    rows = [(sensors.motion(*row)[1], sensors.torque(np.zeros(7))) for row in zip(true_q, true_dq, strict=True)]
    velocity, torque = (
        above_8_hz(x) for x in (np.array([v for v, _ in rows]) - true_dq, np.array([t for _, t in rows]))
    )
    real_velocity, real_torque = above_8_hz(dq), above_8_hz(tau)
    for made, real in ((velocity, real_velocity), (torque, real_torque)):
        np.testing.assert_allclose(made.std(axis=0), real.std(axis=0), rtol=0.12)
        f, P = welch(made, 1000, nperseg=1024, axis=0)
        _, P_real = welch(real, 1000, nperseg=1024, axis=0)
        band = (f >= 10) & (f <= 100)
        level = np.sqrt(P[band].sum(axis=0) / P_real[band].sum(axis=0))
        np.testing.assert_allclose(level[:6], 1, atol=0.25)
        assert 0.8 < level[6] < 1.5  # a torque of 0.01 Nm, in which the reversal of the modelled friction shows
        for low, high in ((20, 40), (40, 60), (60, 100), (100, 200)):
            part = (f >= low) & (f < high)
            ratio = np.sqrt(P[part].sum(axis=0) / P_real[part].sum(axis=0))
            assert 0.7 < np.median(ratio) < 1.3
    for made, real in zip((velocity * torque).mean(axis=0), (real_velocity * real_torque).mean(axis=0), strict=True):
        assert made < 0
        assert made == pytest.approx(real, rel=0.45)
    assert log.quality.repeated_rows / len(log) == pytest.approx(SensorConfig.preset("panda").repeated_rows, abs=0.03)


def test_spectrum_has_the_variance_and_memory_of_its_process() -> None:
    """x(k) = 0.9 x(k-1) + ... has a known variance and correlation: an analytic case for the noise."""
    a = 0.9
    spectrum = NoiseSpectrum(lags=((a, 0.0, 0.0, 0.0),), innovation=(np.sqrt(1 - a * a), -0.6, 0.8))
    np.testing.assert_allclose(impulse_response(spectrum)[:3, 0, 0], np.sqrt(1 - a * a) * a ** np.arange(3))
    noise = Noise(1, (spectrum,), np.random.default_rng(0))
    x = np.array([noise.next()[:, 0] for _ in range(100_000)])
    np.testing.assert_allclose(x.std(axis=0), 1, rtol=0.03)
    assert np.mean(x[1:, 0] * x[:-1, 0]) == pytest.approx(a, abs=0.03)
    assert np.mean(x[:, 0] * x[:, 1]) == pytest.approx(-0.6 * np.sqrt(1 - a * a), abs=0.03)
    assert np.mean(x[3000:, 0] * x[:-3000, 0]) == pytest.approx(0, abs=0.05)  # no block repeats another


def test_ripple_turns_with_the_joint_and_friction_with_its_direction() -> None:
    """Both look like contacts to a detector, so they must come at the angle and with the sign that they are said to."""
    config = SensorConfig(
        torque_noise_nm=0.0, ripple_nm=(0.2,), ripple_per_turn=(100.0,), coulomb_nm=0.5, hysteresis_rad=0.001
    )
    sensors = Sensors(1, config, np.random.default_rng(0), 0.001)
    q = 0.2 * np.sin(np.arange(4000) * 0.002)
    dq = np.gradient(q, 0.001)
    torque = []
    for k in range(len(q)):
        sensors.motion(q[k : k + 1], dq[k : k + 1])
        torque.append(sensors.torque(np.zeros(1))[0])
    steady = np.abs(dq) > 0.1
    waves = np.stack([np.cos(100 * q), np.sin(100 * q), np.sign(dq)], axis=1)
    found, *_ = np.linalg.lstsq(waves[steady], np.array(torque)[steady], rcond=None)
    assert np.hypot(*found[:2]) == pytest.approx(0.2, rel=0.02)
    assert found[2] == pytest.approx(0.5, rel=0.05)


def test_log_has_jittering_stamps_and_repeated_rows() -> None:
    """A host reads late and twice; the monitor has to live with it, so the log must really have it."""
    config = SensorConfig(stamp_jitter_s=1e-4, repeated_rows=0.06)
    t = np.arange(20_000) * 0.001
    stamps, rows = Sensors(1, config, np.random.default_rng(0), 0.001).stamps(t)
    assert np.all(np.diff(stamps) >= 0)
    assert np.diff(stamps).std() == pytest.approx(1e-4 * np.sqrt(2), rel=0.1)
    assert np.mean(np.diff(rows) == 0) == pytest.approx(0.06, abs=0.01)
    assert np.all((np.arange(len(t)) - rows) <= 1)


def test_sensors_of_another_arm_are_refused() -> None:
    """Seven figures for six joints would be broadcast to nonsense or fail without a word."""
    with pytest.raises(TactfulError, match="coulomb_nm: has 2 figures, but the arm has 3 joints"):
        Sensors(3, SensorConfig(coulomb_nm=(0.1, 0.2)), np.random.default_rng(0), 0.001)
    with pytest.raises(TactfulError, match="7 spectra, but the arm has 6 joints"):
        Noise(6, SensorConfig.preset("panda").spectrum, np.random.default_rng(0))
    with pytest.raises(ConfigError, match="one entry for each harmonic"):
        SensorConfig(ripple_nm=(0.1,))
