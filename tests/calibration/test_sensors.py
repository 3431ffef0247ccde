"""What simulated sensors are fitted from."""

import numpy as np
import pytest

from tactful.calibration import CalibrationError, fit_sensors
from tactful.calibration._sensors import _by_speed, _spectrum, _without_ripple
from tactful.monitor import MonitorConfig
from tactful.recordings import Recording
from tactful.simulation import NoiseSpectrum
from tactful.simulation._sensors import Noise


def test_ripple_is_found_and_taken_off() -> None:
    """Ripple is the largest of what is not motion on a real arm; what is not found would be told as noise."""
    rng = np.random.default_rng(0)
    q = np.sin(np.arange(8000) * 0.0015)
    noise = 0.05 * rng.standard_normal(len(q))
    left, amplitude, order = _without_ripple(noise + 0.2 * np.sin(241 * q + 1.0), q, 120.0)
    assert order[1] == pytest.approx(241, abs=0.5)
    assert amplitude[1] == pytest.approx(0.2, rel=0.05)
    assert left.std() == pytest.approx(0.05, rel=0.1)


def test_spectrum_is_recovered() -> None:
    """The fitted process has to make the noise that it was fitted to, both signals and what they share."""
    true = NoiseSpectrum(lags=((0.6, 0.0, -0.3, 0.7),), innovation=(0.8, -0.2, 0.4))
    noise = Noise(1, (true,), np.random.default_rng(1))
    x = np.array([noise.next()[:, 0] for _ in range(40_000)]).T
    again = Noise(1, (_spectrum(x),), np.random.default_rng(2))
    y = np.array([again.next()[:, 0] for _ in range(40_000)]).T
    np.testing.assert_allclose(y.std(axis=1), 1, rtol=0.05)
    for lag in (0, 1, 3):
        np.testing.assert_allclose(
            np.corrcoef(x[0, lag:], x[1, : x.shape[1] - lag])[0, 1],
            np.corrcoef(y[0, lag:], y[1, : y.shape[1] - lag])[0, 1],
            atol=0.05,
        )


def test_growth_with_speed_is_found() -> None:
    """Slow motion is quieter than the exciting one that is fitted to: the line in between is what makes it so."""
    rng = np.random.default_rng(3)
    speed = np.abs(rng.uniform(0, 1.5, (20_000, 1)))
    base, growth = _by_speed((0.1 + 0.2 * speed) * rng.standard_normal(speed.shape), speed)
    assert base[0] == pytest.approx(0.1, abs=0.01)
    assert growth[0] == pytest.approx(0.2, abs=0.01)


def test_another_rate_is_refused() -> None:
    """The noise of 100 Hz says nothing of that between the samples of 1 kHz."""
    t = np.arange(1000) * 0.01
    recording = Recording(t, {name: np.zeros((1000, 7)) for name in ("q", "dq", "tau")}, source="slow.csv")
    with pytest.raises(CalibrationError, match="100 Hz: noise is modelled at 1 kHz"):
        fit_sensors(recording, MonitorConfig(robot={"model": "panda"}), np.full(7, 100.0))
