"""The velocity and the clock of the observer."""

from typing import Any

import numpy as np
import pytest
from scipy.integrate import cumulative_trapezoid

from tactful.dynamics import Dynamics
from tactful.estimation import MomentumObserver, ObserverConfig
from tactful.estimation._velocity import sense, velocity_dtype
from tactful.robots import Robot
from tests._counterparts import require_shared_data

PERIOD_S = 1e-3


def _jittered(seed: int, *, count: int = 4000) -> tuple[np.ndarray, ...]:
    """Return stamps, q, dq and the true time of a robot whose host reads late, misses samples and reads some twice."""
    rng = np.random.default_rng(seed)
    ticks = np.cumsum(rng.choice([0, 1, 2, 8], p=[0.06, 0.88, 0.055, 0.005], size=count))
    true = ticks * PERIOD_S
    stamps = true * 1.0001 + np.abs(rng.normal(0, 2e-4, count)) + 1e-6 * np.arange(count)
    stamps = np.maximum.accumulate(stamps) + 1e-7 * np.arange(count)
    phase = np.arange(7) + 2 * np.pi * true[:, None]
    noise = rng.normal(0, 0.006, (ticks[-1] + 1, 7))[ticks]
    return stamps, 0.2 * np.sin(phase), 0.4 * np.pi * np.cos(phase) + noise, true


def _sensed(stamps: np.ndarray, q: np.ndarray, dq: np.ndarray, **settings: float) -> tuple[np.ndarray, np.ndarray]:
    record: Any = np.zeros(1, velocity_dtype(q.shape[1]))
    for key, value in settings.items():
        record[key] = value
    dt = np.diff(stamps, prepend=stamps[0])
    steps = np.array([sense(record[0], k == 0, dt[k], q[k].copy(), dq[k].copy(), q[k].copy()) for k in range(len(dt))])
    return steps, record[0]["v"].copy()


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_clock_of_the_robot_is_recovered_from_the_stamps_of_a_host(seed: int) -> None:
    """One wrong period makes a false torque of many newton metres, so every step has to be right."""
    stamps, q, dq, true = _jittered(seed)
    steps, _ = _sensed(stamps, q, dq, clock=PERIOD_S)
    assert np.rint(steps[1:] / PERIOD_S) == pytest.approx(np.rint(np.diff(true) / PERIOD_S))


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_clock_of_an_arm_that_creeps_is_recovered_though_its_velocity_is_mostly_noise(seed: int) -> None:
    """At 0.03 rad/s a row that came late, with the sample before, has shown as a false torque of ten newton metres."""
    rng = np.random.default_rng(seed)
    count = 4000
    late = rng.uniform(size=count) < 0.06
    ticks = np.arange(count) - late
    stamps = PERIOD_S * np.arange(count) + rng.normal(0, 1.3e-4, count)
    v = 0.03 / np.sqrt(7) * (1 + 0.3 * np.sin(2 * np.pi * PERIOD_S * np.arange(count)))[:, None] * np.ones(7)  # (N, 7)
    q = np.round(np.cumsum(v * PERIOD_S, axis=0) / 1e-6) * 1e-6
    noise = rng.normal(0, 0.0055, (count, 7))
    steps, _ = _sensed(stamps, q[ticks], (v + noise)[ticks], clock=PERIOD_S, window=0.005)
    told = np.rint(steps[20:] / PERIOD_S)
    assert np.mean(told != np.diff(ticks)[19:]) < 0.002


def test_arm_that_is_stopped_hard_does_not_stop_the_clock() -> None:
    """The measured velocity lags: at an impact the position stands while it still says that the arm moves."""
    stamps, q, dq, _ = _jittered(3)
    q[2000:] = q[2000]
    steps, _ = _sensed(stamps, q, dq, clock=PERIOD_S)
    stopped = stamps[2000:] - stamps[2000]
    assert np.abs(np.cumsum(steps[2000:]) - steps[2000] - stopped).max() < 8 * PERIOD_S


def test_slope_of_the_position_over_a_window_with_a_hole() -> None:
    """The lag of the velocity is half the window, whatever samples are missing: else each hole makes a false torque."""
    t = np.delete(np.arange(100) * PERIOD_S, np.arange(90, 97))
    q = np.tile((3.0 * t**2)[:, None], 7)
    for end in range(88, len(t)):
        _, v = _sensed(t[: end + 1], q[: end + 1], np.zeros_like(q[: end + 1]), window=0.005)
        assert v == pytest.approx(np.full(7, 6.0 * (t[end] - 0.0025)), abs=0.02)


def test_real_residual_is_quieter_by_the_clock_and_the_position() -> None:
    """Why the settings are there: on a real arm they take off most of the noise of the residual."""
    from tactful.recordings import Recording

    recording = Recording.read(require_shared_data() / "panda_free_motion" / "exciting_first_10s.csv")
    rows = (recording.t, recording.q, recording.dq, recording.tau)
    noise = [
        np.std(np.diff(MomentumObserver(Robot.load("panda"), config).run(*rows)[500:], axis=0), axis=0)[:4]
        for config in (ObserverConfig(), ObserverConfig(velocity="position", clock_s=PERIOD_S))
    ]
    assert np.all(noise[1] < 0.25 * noise[0])


def test_slope_of_the_position_makes_no_torque_of_a_jerk() -> None:
    """A singular arm stops a joint within 20 ms: torque and pose half a window ahead of the velocity were an alarm."""
    robot = Robot.load("panda")
    t = np.arange(500) * PERIOD_S
    stop = 1.0 / (1.0 + np.exp((t - 0.3) / 0.004))  # from 1 to 0 in about 20 ms
    dq = np.outer(0.9 * stop, [0.3, 0.2, 1.5, 0.5, 1.0, 1.0, 0.5])
    moved = cumulative_trapezoid(dq, t, axis=0, initial=0)
    q = np.array([0.4, 0.7, 0.0, -1.5, -0.1, 1.0, 1.2]) + moved
    ddq = np.gradient(dq, PERIOD_S, axis=0)
    dynamics = Dynamics(robot)
    tau = np.array([dynamics.inverse_dynamics(*row) for row in zip(q, dq, ddq, strict=True)])
    config = ObserverConfig(velocity="position", bandwidth_hz=100.0)
    r = MomentumObserver(robot, config).run(t, q, dq, tau)[50:]
    assert np.abs(r).max() < 0.02 * np.ptp(tau, axis=0).max()
