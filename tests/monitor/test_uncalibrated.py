"""An arm that nobody calibrated: its motion says how much its thresholds may come down."""

import numpy as np
import pytest

from tactful import Monitor, MonitorConfig, Robot
from tests.monitor._touched import Touch, recording

PUSH = Touch(2.5, 3.3, (0.0, 0.0, 4.0), rise_s=0.1)


@pytest.fixture(scope="module")
def panda() -> Robot:
    """The arm of all recordings here."""
    return Robot.load("panda")


def scale(monitor: Monitor) -> float:
    """Return the scale of the thresholds."""
    return float(monitor._memory.record[0]["glr"]["scale"])


def test_a_light_push_is_found_after_a_second_of_motion(panda: Robot) -> None:
    """The thresholds for the noise of a real arm do not show it; whoever sets the noise keeps them."""
    samples = recording(panda, PUSH, noise_nm=0.02)
    learning = Monitor(panda)
    (event,) = learning.run(samples)
    assert 2.5 < event.detected_s < 2.6
    assert event.end_s == pytest.approx(3.3, abs=0.2)
    assert 0.25 <= scale(learning) < 0.7
    assumed = tuple(0.012 * np.minimum(panda.torque_limit, 100.0))
    assert len(Monitor(panda, MonitorConfig(noise={"model_nm": assumed})).run(samples)) == 0


def test_an_arm_that_rests_or_has_only_set_off_keeps_them(panda: Robot) -> None:
    """What it would show in motion is not known."""
    early = recording(panda, Touch(0.5, 1.2, (0.0, 0.0, 4.0), rise_s=0.1), duration_s=1.3, noise_nm=0.02)
    assert len(Monitor(panda).run(early)) == 0
    resting = Monitor(panda)
    assert len(resting.run(recording(panda, PUSH, speed_rad_s=0.02, noise_nm=0.02))) == 0
    assert scale(resting) == 1.0


def test_an_arm_whose_motion_shows_much_keeps_them(panda: Robot) -> None:
    """Thresholds never come down to what the motion shows itself."""
    noisy = recording(panda, noise_nm=0.4)
    monitor = Monitor(panda)
    assert len(monitor.run(noisy)) == 0
    assert scale(monitor) == 1.0
