"""Hands, sensors and the log of touches."""

import numpy as np
import pytest

from tactful.config import ConfigError
from tactful.control import CartesianImpedance, Pose
from tactful.dynamics import Dynamics
from tactful.recordings import Label
from tactful.robots import Robot
from tactful.simulation import CellConfig, Guide, Push, SensorConfig, WorkCell
from tactful.simulation._sensors import Sensors
from tactful.simulation._truth import TouchLog

ZERO = np.zeros(3)


def test_push_rises_holds_and_falls_without_a_step() -> None:
    """The rise time of a hand decides how fast it can be detected, so it has to be what it says."""
    push = Push(link="x", force_n=(0.0, 20.0, 0.0), start_s=1.0, rise_s=0.1, hold_s=0.5, fall_s=0.2)
    t = np.arange(0.9, 2.0, 0.001)
    force = np.array([push.force(x, ZERO, ZERO)[1] for x in t])
    assert push.force(1.05, ZERO, ZERO)[1] == pytest.approx(10.0)
    np.testing.assert_allclose(force[(t > 1.1) & (t < 1.6)], 20.0)
    assert not force[t <= 1.0].any()
    assert not force[t >= 1.801].any()
    assert np.abs(np.diff(force)).max() < 0.5


def test_guide_draws_the_arm_to_its_target() -> None:
    """A hand that leads the arm pulls it against its own spring, no harder than it is strong."""
    panda = Robot.load("panda")
    R, p = Dynamics(panda).pose(panda.home)
    q7 = p + np.array([0.0, 0.0, 0.107])  # origin of the last link, above the flange
    guide = Guide(
        link="panda_link7", target_m=tuple(q7 + np.array([0.0, 0.06, 0.0])), start_s=0.1, hold_s=2.0, strength_n=15.0
    )
    cell = WorkCell(panda, hands=[guide], sensors=SensorConfig.exact())
    *_, last = cell.run(CartesianImpedance(panda), lambda t: Pose(R, p), 1.5)
    (contact,) = cell.contacts
    moved = cell.data.body("panda_link7").xpos - q7
    assert 0.025 < moved[1] < 0.06
    assert contact.kind == "cooperation"
    assert contact.peak_force_n < 16
    assert last.t == pytest.approx(1.499)


def test_exact_sensors_change_nothing() -> None:
    """Tests of physics need a truth that no sensor has touched."""
    sensors = Sensors(2, SensorConfig.exact(), np.random.default_rng(0), 0.001)
    q, dq, tau = np.array([0.1, 0.2]), np.array([1.0, -1.0]), np.array([3.0, 4.0])
    measured_q, measured_dq = sensors.motion(q, dq)
    assert measured_q is not q
    np.testing.assert_array_equal(measured_q, q)
    np.testing.assert_array_equal(measured_dq, dq)
    np.testing.assert_array_equal(sensors.torque(tau), tau)


def test_sensors_do_what_their_settings_say() -> None:
    """Resolution, differenced velocity, noise and offset, each as set."""
    step = 0.01
    config = SensorConfig(encoder_step_rad=step, velocity="difference", torque_noise_nm=0.1, torque_offset_nm=2.0)
    sensors = Sensors(1, config, np.random.default_rng(5), 0.001)
    assert sensors.motion(np.array([0.1234]), np.array([9.0]))[0][0] == pytest.approx(0.12)
    q, dq = sensors.motion(np.array([0.1456]), np.array([9.0]))
    assert (q[0], dq[0]) == pytest.approx((0.15, 30.0))
    torque = np.array([(sensors.motion(q, dq), sensors.torque(np.array([7.0]))[0])[1] for _ in range(4000)])
    offset = 2.0 * np.random.default_rng(5).standard_normal()
    assert torque.mean() - 7 == pytest.approx(offset, abs=0.01)
    assert torque.std() == pytest.approx(0.1, rel=0.05)


def test_bounces_are_one_contact() -> None:
    """An impact that bounces is one event to whoever labels it, and two touches a second apart are two."""
    log = TouchLog("collision", "post")
    for t, link, force in [(1.0, 5, 0.4), (1.001, 6, 30.0), (1.002, 6, 0.0), (1.05, 6, 2.0), (2.0, 3, 0.5)]:
        log.add(t, link, force)
    first, second = log.contacts(0.1)
    assert (first.touch_s, first.visible_s, first.end_s, first.link, first.peak_force_n) == (1.0, 1.001, 1.05, 6, 30.0)
    assert first.label() == Label("collision", 1.0, 1.05, 6, 1.001, 30.0)
    assert (second.touch_s, second.visible_s, second.link) == (2.0, None, 3)


def test_settings_are_checked() -> None:
    """Mistakes in a setting are told when it is made."""
    with pytest.raises(ConfigError, match="did you mean 'substeps'"):
        CellConfig(substep=2)
    with pytest.raises(ConfigError, match="velocity"):
        SensorConfig(velocity="filtered")
