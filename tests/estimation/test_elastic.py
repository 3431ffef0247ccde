"""The torque of elastic joints, and that the observer makes the same of it as of a measured joint torque."""

from dataclasses import replace

import numpy as np
import pytest

from tactful.config import ConfigError
from tactful.errors import TactfulError
from tactful.estimation import MomentumObserver, ObserverConfig, elastic_torque
from tactful.robots import Robot

PANDA = Robot.load("panda")
ELASTIC = replace(PANDA, stiffness=[14e3] * 4 + [9e3] * 3, damping=np.linspace(30, 60, 7))


def test_both_ways_to_the_residual_agree() -> None:
    """With motor-side signals or with tau_J and the elastic term, r estimates the same external torque."""
    t = np.arange(2000) * 1e-4
    i = np.arange(7)
    q = PANDA.home + 0.3 * np.sin((2 + i) * t[:, None] + i)
    dq = 0.3 * (2 + i) * np.cos((2 + i) * t[:, None] + i)
    bend = 1e-3 * np.sin(180 * t[:, None] + i)  # theta - q, ringing
    bend_speed = 0.18 * np.cos(180 * t[:, None] + i)
    tau_j = ELASTIC.stiffness * bend
    tau = elastic_torque(ELASTIC, q, dq, q + bend, dq + bend_speed)
    np.testing.assert_allclose(tau, tau_j + ELASTIC.damping * bend_speed)
    by_motor = MomentumObserver(ELASTIC).run(t, q, dq, tau)
    by_sensor = MomentumObserver(ELASTIC, ObserverConfig(joint_flexibility=True)).run(t, q, dq, tau_j)
    late = t > 0.1  # they start apart by the elastic term
    assert np.abs(by_motor - by_sensor)[late].max() < 0.01
    assert np.abs(by_motor - MomentumObserver(ELASTIC).run(t, q, dq, tau_j))[late].max() > 1.0


def test_one_sample() -> None:
    """A loop passes rows."""
    zero = np.zeros(7)
    np.testing.assert_array_equal(elastic_torque(ELASTIC, zero, zero, zero + 1e-3, zero), 1e-3 * ELASTIC.stiffness)


def test_bad_input() -> None:
    """An arm without figures would give NaN for ever."""
    zero = np.zeros(7)
    with pytest.raises(ConfigError, match="joint panda_joint1 of panda"):
        elastic_torque(PANDA, zero, zero, zero, zero)
    with pytest.raises(TactfulError, match="theta has shape"):
        elastic_torque(ELASTIC, zero, zero, zero[:6], zero)
