"""The loop: every sample once through the monitor, torques in time, losses counted, ends that leave nothing open."""

import numpy as np
import pytest

from tactful import Monitor, MonitorConfig, Recording
from tactful.control import CartesianImpedance, Pose
from tactful.dynamics import Dynamics
from tactful.live import Session, open_source
from tactful.live._source import Traffic
from tactful.reaction import NAMED
from tactful.simulation import Push, WorkCell
from tests.live._fake import PANDA, FakeSource, times

CONFIG = MonitorConfig(robot={"model": "panda"})


@pytest.fixture(scope="module")
def pushed() -> Recording:
    """An arm at rest that a hand pushes."""
    home = Pose(*Dynamics(PANDA).pose(PANDA.home))
    cell = WorkCell(PANDA, hands=[Push(link="panda_link7", force_n=(0, 15, 0), start_s=0.8, hold_s=0.3)])
    for _ in cell.run(CartesianImpedance(PANDA), lambda t: home, 1.6):
        pass
    return cell.recording()


def test_event_comes_with_its_sample(pushed: Recording, tmp_path) -> None:  # type: ignore[no-untyped-def]
    """A reaction can be no faster than the event: it has to come with the sample in which the detector fires."""
    file = tmp_path / "pushed.npz"
    pushed.save(file)
    session = Session(open_source(f"replay:{file}", CONFIG, speed=0))
    session.open()
    steps = list(session.steps())
    assert [step.sample.t for step in steps] == pushed.t.tolist()
    began = [step for step in steps if step.event is not None and step.event.phase == "began"]
    assert began
    assert all(step.event.detected_s == step.sample.t for step in began if step.event is not None)
    timeline = Monitor(config=CONFIG).run(pushed)
    latest = {step.event.id: step.event for step in steps if step.event is not None}
    assert [(e.kind, e.onset_s) for e in latest.values()] == [(e.kind, e.onset_s) for e in timeline.events]
    report = session.report
    assert (report.samples, report.lost, report.reconnects, report.degraded) == (len(pushed), 0, 0, False)


def test_every_sample_is_processed_for_a_minute() -> None:
    """A minute of the robot's time: 60 000 samples in, 60 000 through the monitor, none skipped."""
    session = Session(FakeSource(times(0.0, 60_000)))
    session.open()
    report = session.run()
    assert (report.samples, report.health.samples, report.lost) == (60_000, 60_000, 0)
    assert not report.health.degraded
    assert report.contacts == 0


def test_lost_samples_are_counted() -> None:
    """A jump of the clock says how many samples fit in."""
    session = Session(FakeSource(times(0.0, 100) + times(0.105, 50) + times(0.156, 50)))
    session.open()
    report = session.run()
    assert report.lost == 5 + 1
    assert report.degraded


def test_late_samples_are_counted() -> None:
    """A sample is late by the host's clock, against its stamp; the one after a late one is not."""
    traffic = Traffic(1000.0)
    for k in range(10):
        traffic.count(0.001 * k, 5.0 + 0.001 * k + (0.004 if k == 5 else 0.0))
    assert (traffic.samples, traffic.lost, traffic.late) == (10, 0, 1)


def test_lost_source_is_connected_again() -> None:
    """A cable that is plugged in again: the run goes on, time too though the robot's clock began anew."""
    source = FakeSource(times(5.0, 300), times(0.0, 300), refuse=2)
    session = Session(source)
    session.open()
    stamps = [step.sample.t for step in session.steps()]
    report = session.report
    assert report.reconnects == 1
    assert report.problem is None
    assert report.degraded
    assert len(stamps) >= 599
    assert np.diff(stamps).min() > 0
    assert report.health.backward == 0
    assert source.closed > 0


def test_source_that_stays_away_ends_the_run() -> None:
    """After a while nobody comes back: the run ends by itself and says why."""
    source = FakeSource(times(0.0, 50), [], refuse=10**6)
    session = Session(source, reconnect_s=0.5)
    session.open()
    report = session.run()
    assert report.samples == 50
    assert report.problem is not None
    assert "the line is cut; not found again in 0.5 s" in report.problem


def test_commanded_arm_gets_a_torque_for_every_sample() -> None:
    """An arm whose loop misses a torque stops with a fault."""
    source = FakeSource(times(0.0, 500), commanded=True)
    session = Session(source, policy=NAMED["stop"])
    session.open()
    session.run()
    assert len(source.torques) == 500
    assert np.isfinite(source.torques).all()


def test_commanded_arm_is_not_taken_up_again() -> None:
    """An arm that was cut off in motion has stopped by itself; nobody asked for it to move again."""
    source = FakeSource(times(0.0, 100), times(0.2, 100), commanded=True)
    session = Session(source, policy=NAMED["stop"])
    session.open()
    report = session.run()
    assert report.samples == 100
    assert report.problem == "fake: the line is cut"
    assert source.opened == 1


def test_stop_brings_a_commanded_arm_to_rest_first() -> None:
    """Ctrl-C in motion: the arm is stopped in order, then let go."""
    source = open_source("sim", speed=0)
    session = Session(source)
    session.open()
    for step in session.steps():
        if step.sample.t > 2.0:
            session.stop()
            break
    speed = np.abs(step.sample.dq).max()  # type: ignore[arg-type]
    assert speed > 0.1
    session = Session(source)
    session.open()
    last = None
    for last in session.steps():
        if last.sample.t > 2.0:
            session.stop()
    assert last is not None
    assert last.reaction == "stop"
    assert np.abs(last.sample.dq).max() < 0.02  # type: ignore[arg-type]
    assert last.sample.t < 4.1


def test_duration_is_on_the_clock_of_the_source() -> None:
    """A second of the robot is a second, at whatever speed it is played."""
    session = Session(FakeSource(times(7.0, 5000)))
    session.open()
    assert session.run(1.0).duration_s == pytest.approx(1.0)


def test_arm_of_the_settings_is_monitored() -> None:
    """A calibrated arm is not the built-in one: what the settings say of it has to reach the monitor."""
    mass_kg = []
    for payload_kg in (0.0, 1.5):
        session = Session(open_source("sim", MonitorConfig(robot={"payload_kg": payload_kg}), speed=0))
        session.open()
        assert session.monitor.robot is not None
        mass_kg.append(session.monitor.robot.mass.sum())
        session.close()
    assert mass_kg[1] == pytest.approx(mass_kg[0] + 1.5)


def test_collision_and_help_are_told_in_simulation() -> None:
    """Nobody is there to touch the arm: what meets it in every round has to be told, by its kind, and nothing else."""
    session = Session(open_source("sim", speed=0))
    session.open()
    told = {step.event.id: step.event.kind for step in session.steps(13.8) if step.event is not None}
    assert list(told.values()) == ["collision", "cooperation"] * 2
    assert session.report.late is None
    assert "late" not in str(session.report)
