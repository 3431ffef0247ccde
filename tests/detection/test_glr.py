"""The fast detector against its formula, and its statistic against the distribution that it should have."""

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import stats

from tactful import Robot
from tactful.config import ConfigError
from tactful.detection import FastConfig, NoiseConfig, _glr
from tactful.detection._glr import glr_record, taps
from tactful.dynamics import Dynamics, arm_record, motion_record
from tactful.estimation import ObserverConfig
from tactful.estimation._momentum_observer import observe_motion, observer_record

RATE_HZ = 1000.0
NOISE = NoiseConfig(velocity_rad_s=0.006, torque_nm=0.2, model_nm=0.1)
Array = NDArray[np.float64]


def statistics(robot: Robot, config: FastConfig, q: Array, dq: Array, tau: Array, *, drift: bool = True) -> Array:
    """Return the statistic of every window after each sample (k, windows)."""
    arm, motion = arm_record(robot)[0], motion_record(robot.n)[0]
    observer: Any = observer_record(robot, ObserverConfig())[0]
    glr = glr_record(config, NOISE, np.ones(robot.n), RATE_HZ)[0]
    if not drift:
        glr["drift_gain"] = 0.0
    out = []
    for k in range(len(q)):
        observe_motion(arm, motion, observer, 1 / RATE_HZ, q[k], dq[k], tau[k])
        _glr.take_momentum(glr, arm, motion, observer, 1 / RATE_HZ)
        if k == 0 and not drift:
            glr["drift"] = 0.0
        _glr.step(glr, dq[k], False)
        out.append(glr["statistic"][: glr["windows"]].copy())
    return np.array(out)


def test_the_weights_show_a_rising_torque_better_than_a_parabola() -> None:
    """By a fifth, at hardly more noise; the parabola is what the noise of the velocity alone would ask for."""
    assert all(taps(length).sum() == pytest.approx(1) for length in (1, 2, 5, 80))
    j = np.arange(1, 81)
    parabola = j * (81.0 - j) / np.sum(j * (81.0 - j))
    assert taps(80) @ j == pytest.approx(1.2 * parabola @ j, rel=0.02)
    assert np.sum(taps(80) ** 2) < 1.07**2 * np.sum(parabola**2)


def test_the_statistic_is_its_formula() -> None:
    """Torque over each step from the momentum, weighted mean, covariance through M, norm: written with numpy."""
    robot = Robot.load("panda")
    dynamics = Dynamics(robot)
    rng = np.random.default_rng(1)
    k = 60
    q = robot.home + np.cumsum(0.001 * rng.normal(size=(k, 7)), axis=0)
    dq, tau = 0.2 * rng.normal(size=(k, 7)), 5 * rng.normal(size=(k, 7))
    config = FastConfig(windows_s=(0.005, 0.012), threshold=6.0)
    ours = statistics(robot, config, q, dq, tau, drift=False)
    p = np.array([dynamics.momentum(a, b) for a, b in zip(q, dq, strict=True)])
    s = np.array(
        [t + dynamics.coriolis_transposed(a, b) - dynamics.gravity(a) for a, b, t in zip(q, dq, tau, strict=True)]
    )
    x = np.diff(p, axis=0) * RATE_HZ - 0.5 * (s[1:] + s[:-1])
    for w, length in enumerate((5, 12)):
        c = taps(length)
        y = c @ x[-length:]
        # The covariance was brought up to date at most a few samples ago.
        M = dynamics.mass_matrix(q[-1])
        a = np.sum(np.diff(c, prepend=0, append=0) ** 2) * RATE_HZ**2
        V = a * 0.006**2 * M @ M + np.eye(7) * (np.sum(c**2) * 0.2**2 + 0.1**2)
        assert ours[-1, w] == pytest.approx(np.sqrt(y @ np.linalg.solve(V, y)), rel=0.02)


def test_without_contact_the_statistic_is_chi_distributed() -> None:
    """With just the noise that it assumes, in any pose: so a threshold means a rate of false alarms."""
    robot = Robot.load("panda")
    dynamics = Dynamics(robot)
    rng = np.random.default_rng(2)
    values = []
    config = FastConfig(windows_s=(0.01,), threshold=6.0)
    for _ in range(60):
        q = rng.uniform(robot.lower, robot.upper)
        tau = dynamics.gravity(q) + 0.2 * rng.normal(size=(40, 7)) + 0.1 * rng.normal(size=7)
        dq = 0.006 * rng.normal(size=(40, 7))
        values.extend(statistics(robot, config, np.tile(q, (40, 1)), dq, tau, drift=False)[-1:, 0])
    assert stats.kstest(values, stats.chi(7).cdf).pvalue > 0.001


def test_windows_that_fall_together_at_a_low_rate_are_one() -> None:
    """At 100 Hz 5 and 10 ms are both one sample; the higher threshold holds."""
    config = FastConfig(windows_s=(0.005, 0.01, 0.04), threshold=(7.0, 9.0, 6.0))
    assert config.windows(100.0) == {1: 9.0, 4: 6.0}
    assert config.windows(1000.0) == {5: 7.0, 10: 9.0, 40: 6.0}


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"windows_s": (0.02, 0.01)}, "ascend"),
        ({"windows_s": (0.01, 0.02), "threshold": (6.0, 6.0, 6.0)}, "3 thresholds for 2 windows_s"),
        ({"windows_s": ()}, "windows_s"),
    ],
)
def test_windows_that_make_no_sense_are_refused(settings: dict[str, Any], message: str) -> None:
    """One line each."""
    with pytest.raises(ConfigError, match=message):
        FastConfig(**settings)


def test_noise_for_another_number_of_joints_is_refused() -> None:
    """A calibration of a Panda is none of a UR."""
    with pytest.raises(ConfigError, match=r"noise\.torque_nm: has 7 numbers; give one, or one for each of 6"):
        glr_record(FastConfig(), NoiseConfig(torque_nm=(0.1,) * 7), np.ones(6), RATE_HZ)


def test_a_joint_that_has_just_reversed_is_trusted_less() -> None:
    """Its friction changes, and every model of it is wrong by something: not a contact."""
    noise = NoiseConfig(velocity_rad_s=0.0, torque_nm=0.1, model_nm=0.1, reversal_nm=1.0)
    levels = []
    for speeds in ((0.5,) * 100, (0.5,) * 50 + (-0.5,) * 50):
        glr = glr_record(FastConfig(windows_s=(0.02,), threshold=6.0), noise, np.ones(1), RATE_HZ)[0]
        for k, speed in enumerate(speeds):
            glr["x"] = 1.0 if k > 60 else 0.0
            _glr.step(glr, np.array([speed]), False)
        levels.append(float(glr["level"][0]))
    assert levels[1] < 0.2 * levels[0]


def test_errors_that_come_together_count_once() -> None:
    """A wrong inertia shows in several joints at a time: what follows the correlation is less of a sign of contact."""
    levels = []
    for correlation in ((), ((1.0, 0.9), (0.9, 1.0))):
        noise = NoiseConfig(velocity_rad_s=0.0, torque_nm=0.0, model_nm=0.2, correlation=correlation)
        config = FastConfig(windows_s=(0.02,), threshold=1.0)
        glr = glr_record(config, noise, np.ones(2), RATE_HZ)[0]
        glr["drift_gain"] = 0.0
        for _ in range(40):
            glr["x"] = 1.0
            _glr.step(glr, np.zeros(2), False)
        levels.append(float(glr["level"][0]))
    assert levels == pytest.approx([5 * np.sqrt(2), 5 * np.sqrt(2 / 1.9)])


@pytest.mark.parametrize(
    ("correlation", "text"),
    [
        (((1.0, 0.5),), "has 1 rows; give 2 of 2 numbers"),
        (((1.0, 0.5), (0.2, 1.0)), "is none"),
        (((1.0, 1.0), (1.0, 1.0)), "is none"),
    ],
)
def test_a_correlation_that_is_none_is_refused(correlation: tuple[tuple[float, ...], ...], text: str) -> None:
    """A covariance without a root would make every statistic meaningless."""
    with pytest.raises(ConfigError, match=text) as error:
        NoiseConfig(correlation=correlation).correlations(2)
    assert "\n" not in str(error.value)
