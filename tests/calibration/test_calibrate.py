from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from tactful.calibration import Calibration, CalibrationError, calibrate, cross_validate
from tactful.calibration._columns import columns_of
from tactful.calibration._fit import fit
from tactful.calibration._motion import stretches_of
from tactful.dynamics import Dynamics
from tactful.errors import TactfulError
from tactful.estimation import ObserverConfig
from tactful.monitor import Monitor, MonitorConfig, RobotConfig
from tactful.recordings import Recording
from tactful.robots import Robot
from tests._counterparts import require_shared_data
from tests.calibration._motion import BIAS, COULOMB, PAYLOAD, VISCOUS, motion

PANDA = MonitorConfig(robot=RobotConfig(model="panda"))


@pytest.fixture(scope="module")
def found() -> Calibration:
    """A calibration that finds friction, bias, payload and other links."""
    return calibrate([motion()], PANDA)


def test_friction_and_bias_are_found_within_their_uncertainty(found: Calibration) -> None:
    """An uncertainty that is stated has to be one."""
    fit = found.fit
    for value, true, sd in (
        (fit.bias, BIAS, fit.sd["bias"]),
        (fit.coulomb, COULOMB, fit.sd["coulomb"]),
        (fit.viscous, VISCOUS, fit.sd["viscous"]),
    ):
        assert np.all(np.abs(value - true) < 4 * sd + 0.02)
    assert fit.coulomb == pytest.approx(COULOMB, abs=0.1)


def test_payload_is_found(found: Calibration) -> None:
    """The load that nobody entered is the most common reason for a force in free air."""
    assert found.fit.payload_kg == pytest.approx(PAYLOAD[0], abs=max(0.3, 3 * found.fit.sd["payload"][0]))


def test_residual_falls_on_held_out_time(found: Calibration) -> None:
    """The point of it all; in-sample figures would flatter."""
    assert np.all(found.after_nm < 0.5 * found.before_nm)
    assert np.mean(found.after_nm / found.before_nm) < 0.25


def test_saved_configuration_makes_the_calibrated_monitor(found: Calibration, tmp_path: Path) -> None:
    """What `monitor --config` uses has to be what was fitted, links, payload and friction."""
    found.save(tmp_path / "monitor.toml")
    config = MonitorConfig.load(tmp_path / "monitor.toml")
    robot = config.robot.load()
    assert robot is not None
    q = Robot.load("panda").home
    assert Dynamics(robot).gravity(q) == pytest.approx(Dynamics(found.fit.robot).gravity(q), abs=1e-4)
    assert config.observer.bias_nm == pytest.approx(found.fit.bias, abs=1e-4)
    assert config.provenance["recordings"] == ["motion.csv"]
    assert config == found.config
    settled = config.model_copy(update={"contact": config.contact.model_copy(update={"warm_up_s": 2.0})})
    assert len(Monitor(config=settled).run(motion(noise_seed=7))) == 0


def test_known_payload_is_taken_as_it_is() -> None:
    """A payload that was weighed is better than any estimate."""
    robot = Robot.load("panda")
    stretches = stretches_of([motion()], robot)
    columns = columns_of(stretches, robot.with_payload(*PAYLOAD), ObserverConfig())
    found = fit(columns, robot, PAYLOAD)
    assert found.payload_kg == PAYLOAD[0]
    assert found.robot.mass.sum() == pytest.approx(found.links.mass.sum() + PAYLOAD[0])
    assert found.residual.std(axis=0) == pytest.approx(np.zeros(7), abs=0.1)


def _touched() -> Recording:
    recording = motion()
    tau = np.array(recording.tau)
    rows = (recording.t > 3.0) & (recording.t < 3.5)
    tau[rows] += [2.0, 8.0, 1.0, 5.0, 0.5, 1.0, 0.0]
    return recording.with_channels(tau=tau)


def _still() -> Recording:
    recording = motion()
    q = np.broadcast_to(recording.channels["q"][0], recording.channels["q"].shape)
    return recording.with_channels(q=q, dq=np.zeros(q.shape))


@pytest.mark.parametrize(
    ("recording", "text"),
    [
        (_touched, r"something touches the arm from 3\.0\d to 3\.[45]\d s"),
        (_still, "the arm stands still"),
        (lambda: motion().between(0.0, 1.6), "1.6 s are too short"),
        (lambda: motion().with_channels(tau=None), "lacks tau"),
        (lambda: motion().with_channels(tau=-motion().channels["tau"]), "the torque is not that of panda"),
        (
            lambda: motion().with_channels(**{k: v[:, :6] for k, v in motion().channels.items()}),
            "has 6 joints, but panda",
        ),
    ],
    ids=["contact", "standstill", "short", "no torque", "wrong sign", "joints"],
)
def test_bad_recordings_are_refused_in_one_line(recording: Callable[[], Recording], text: str) -> None:
    """A calibration from contact or of another arm would hide every contact after it."""
    with pytest.raises(CalibrationError, match=text) as error:
        calibrate([recording()], PANDA)
    assert "\n" not in str(error.value)
    assert str(error.value).startswith("motion.csv: ")


def test_robot_has_to_be_named() -> None:
    """Without an arm there is no residual."""
    with pytest.raises(TactfulError, match="which arm"):
        calibrate([motion()], MonitorConfig())


@pytest.fixture(scope="module")
def real() -> Calibration:
    """A calibration of a real arm."""
    return calibrate([Recording.read(require_shared_data() / "panda_free_motion" / "exciting_first_10s.csv")], PANDA)


def test_real_arm_is_explained_better_than_by_ridge_regression(real: Calibration) -> None:
    """A plain ridge fit on 10 s leaves these on unseen motion of the same arm, low-passed at 20 Hz."""
    ridge = np.array([0.36, 0.50, 0.39, 0.34, 0.09, 0.13, 0.06])
    public = np.array([0.81, 2.59, 1.81, 2.94, 0.59, 0.72, 0.27])
    assert np.all(real.after_nm < 1.1 * ridge)
    assert np.all(real.after_nm < 0.5 * public)
    assert np.mean(real.after_nm / public) < 0.25


def test_real_clock_is_found(real: Calibration) -> None:
    """The host's stamps jitter by 15 %; position and velocity tell the robot's own millisecond."""
    assert real.config.observer.clock_s == 1e-3
    assert real.config.observer.velocity == "position"


def _rest(channels: dict[str, int], rate_hz: float, *, touched: bool = False) -> Recording:
    """An arm at rest, with what it estimates itself."""
    rng = np.random.default_rng(5)
    t = np.arange(0, 6.0, 1 / rate_hz)
    values = {name: 0.1 + 0.05 * rng.normal(size=(len(t), width)) for name, width in channels.items()}
    if touched:
        for name in values:
            values[name][(t > 3.0) & (t < 4.0)] += 3.0
    if "tau_ext" in values:
        values["q"] = np.tile(Robot.load("panda").home, (len(t), 1))
    return Recording(t, values, source="rest.csv")


@pytest.mark.parametrize(
    ("channels", "config", "rate_hz"),
    [({"wrench": 6}, MonitorConfig(), 80.0), ({"tau_ext": 7}, PANDA, 250.0)],
    ids=["wrench at 80 Hz", "tau_ext at 250 Hz"],
)
def test_robots_own_estimate_is_calibrated(channels: dict[str, int], config: MonitorConfig, rate_hz: float) -> None:
    """Many arms give no torque, at any rate; the monitor has to be quiet at rest, and find a touch, with the result."""
    found = calibrate([_rest(channels, rate_hz)], config)
    assert found.fit is None
    assert found.config.source == next(iter(channels))
    assert found.after_nm == pytest.approx(np.full(next(iter(channels.values())), 0.05), rel=0.2)
    assert "the noise of motion is not in the thresholds" in found.not_excited[0]
    assert len(Monitor(config=found.config).run(_rest(channels, rate_hz))) == 0
    (event,) = Monitor(config=found.config).run(_rest(channels, rate_hz, touched=True))
    assert event.onset_s == pytest.approx(3.0, abs=0.1)
    with pytest.raises(CalibrationError, match=r"something touches the arm from 3\.\d\d to 4\.\d\d s"):
        calibrate([_rest(channels, rate_hz, touched=True)], config)


def test_cross_validation_needs_a_rest() -> None:
    """What was calibrated from cannot test the calibration."""
    with pytest.raises(TactfulError, match="too short to calibrate from 8 s and test"):
        next(cross_validate(motion(), PANDA, window_s=8.0))


def test_few_seconds_of_a_real_arm_hold_for_the_others() -> None:
    """Its second half has a reversal that the first has not seen, and the other way round."""
    recording = Recording.read(require_shared_data() / "panda_free_motion" / "exciting_first_10s.csv")
    for split in cross_validate(recording, PANDA, window_s=5.0, step_s=5.0):
        assert not split.false_alarms_s
        assert split.highest_level < 0.9
        assert np.mean(split.after_nm / split.before_nm) < 0.3
