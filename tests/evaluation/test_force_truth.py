"""Truth from a force/torque sensor, on forces made by hand and on the real pad."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import ArrayLike

from tactful import Monitor, MonitorConfig, Recording, Robot
from tactful.evaluation import (
    EvaluationError,
    Figures,
    Outcome,
    evaluate,
    force_error,
    identified_force,
    labels_from_wrench,
)
from tests._counterparts import require_shared_data

PRESSES = {1: (2.59, 9.14), 2: (3.51, 9.25), 3: (2.31, 10.41), 4: (2.89, 9.21)}
"""Between these times the sensor of each file shows more than 1 N [s]."""


def measured(force_z: ArrayLike, rate_hz: float = 100.0) -> Recording:
    """Return a recording of a force along z."""
    z = np.asarray(force_z, dtype=np.float64)
    wrench = np.zeros((len(z), 6))
    wrench[:, 2] = z
    t = np.arange(len(z)) / rate_hz
    return Recording(t=t, channels={"wrench_ft": wrench, "wrench": wrench}, source="pad.csv")


def test_onset_lies_before_the_threshold() -> None:
    """A ramp of 1 N/s: touched at 0.2 N, visible at 1 N, over at 0.2 N."""
    ramp = np.concatenate([np.zeros(100), np.arange(0, 3, 0.01), np.arange(3, 0, -0.01), np.zeros(100)])
    (label,) = labels_from_wrench(measured(-ramp))
    assert label.kind == "contact"
    assert label.start_s == pytest.approx(1.21, abs=0.011)
    assert label.visible_s == pytest.approx(2.01, abs=0.011)
    assert label.end_s == pytest.approx(6.79, abs=0.011)
    assert label.peak_force_n == pytest.approx(3.0)


def test_short_pauses_are_no_end() -> None:
    """A finger that lifts for 50 ms still presses; one that lifts for 200 ms presses twice."""
    press, pause = np.full(50, 3.0), np.zeros(5)
    free = np.zeros(50)
    assert len(labels_from_wrench(measured(np.concatenate([free, press, pause, press, free])))) == 1
    assert len(labels_from_wrench(measured(np.concatenate([free, press, np.zeros(20), press, free])))) == 2
    assert len(labels_from_wrench(measured(np.concatenate([free, press, pause, press, free])), debounce_s=0.03)) == 2


def test_spikes_and_weak_touches_are_no_contacts() -> None:
    """One row over the threshold is a spike of the sensor; half a newton stays below it."""
    free = np.zeros(50)
    assert labels_from_wrench(measured(np.concatenate([free, [5.0], free]))) == ()
    assert labels_from_wrench(measured(np.concatenate([free, np.full(50, 0.5), free]))) == ()
    assert labels_from_wrench(measured(free)) == ()


def test_bad_rows_are_skipped() -> None:
    """NaN and backward time in the log must not end in a crash or a label that runs backward."""
    recording = measured(np.concatenate([np.zeros(50), np.full(50, 3.0), np.zeros(50)]))
    t, wrench = np.array(recording.t), np.array(recording.channels["wrench_ft"])
    t[70], wrench[75] = 0.1, np.nan
    (label,) = labels_from_wrench(replace(recording, t=t, channels={"wrench_ft": wrench}))
    assert (label.start_s, label.end_s) == (0.5, 0.99)


def test_what_is_no_truth() -> None:
    """No sensor, and levels in the wrong order: one line."""
    recording = measured(np.zeros(10))
    with pytest.raises(EvaluationError, match=r"pad.csv: no force/torque sensor was recorded: wrench_ft is not among"):
        labels_from_wrench(recording.with_channels(wrench_ft=None))
    with pytest.raises(EvaluationError, match="the threshold not below the low level"):
        labels_from_wrench(recording, threshold_n=0.1)


def test_force_error_takes_the_bias_out() -> None:
    """An estimate with an offset, 10 % too large: the error is 10 % of the press, the offset does not count."""
    free, press = np.zeros(300), np.full(300, 4.0)
    recording = measured(np.concatenate([free, press, free]))
    wrench = 1.1 * recording.channels["wrench_ft"] + 0.7
    recording = replace(recording.with_channels(wrench=wrench), labels=labels_from_wrench(recording))
    config = MonitorConfig(fast={"bias_limit": 0.0}).fitted_to(100.0)
    timeline = Monitor(config=config).run(recording, trace=True)
    error = force_error(recording, timeline)
    assert error.rms_n[:2] == pytest.approx((0.0, 0.0), abs=1e-9)
    assert error.rms_n[2] == pytest.approx(0.4, abs=1e-9)
    assert error.mean_n[2] == pytest.approx(0.4, abs=1e-9)
    with pytest.raises(EvaluationError, match="no trace"):
        force_error(recording, replace(timeline, trace=None))
    with pytest.raises(EvaluationError, match="no labelled contact"):
        force_error(replace(recording, labels=()), timeline)


def on_the_pad(number: int) -> tuple[Recording, Outcome, tuple[float, ...]]:
    """Return one file of the pad with its truth, what the monitor made of it, and the error of its force."""
    recording = Recording.read(require_shared_data() / "panda_tactile_pad" / f"data_pos_{number}.csv")
    recording = replace(recording, labels=labels_from_wrench(recording))
    timeline = Monitor(config=MonitorConfig().fitted_to(recording.rate_hz)).run(recording, trace=True)
    return recording, evaluate(recording, timeline), force_error(recording, timeline).rms_n


def test_the_recorded_torque_tells_the_force_on_the_pad() -> None:
    """With a prior on the wrench and the bias kept in contact, 0.40 N RMS against the sensor, over all rows."""
    errors = []
    for number in PRESSES:
        recording, _, _ = on_the_pad(number)
        timeline = Monitor(config=MonitorConfig().fitted_to(recording.rate_hz)).run(recording)
        force = identified_force(recording, timeline, Robot.load("panda"))
        assert force is not None
        errors.append(force - recording.channels["wrench_ft"][:, :3])
    assert np.sqrt((np.concatenate(errors) ** 2).sum(axis=1).mean()) < 0.40
    assert identified_force(recording.with_channels(jacobian=None), timeline, None) is None


@pytest.mark.parametrize("number", PRESSES)
def test_each_file_of_the_pad_is_one_press(number: int) -> None:
    """The truth itself: what a person sees in the sensor's curve."""
    recording, _, _ = on_the_pad(number)
    (label,) = recording.labels
    visible_s, gone_s = PRESSES[number]
    assert getattr(label, "visible_s", None) == pytest.approx(visible_s, abs=0.01)
    assert label.end_s == pytest.approx(gone_s, abs=0.04)  # from 1 N to 0.2 N takes two rows at most
    assert visible_s - 0.12 < label.start_s <= visible_s + 0.01


def test_every_press_is_found_and_none_invented() -> None:
    """The real thing, 80 Hz and a wrench alone: four presses, four events, and how late and how wrong they are."""
    runs = [on_the_pad(number) for number in PRESSES]
    figures = Figures.of(outcome for _, outcome, _ in runs)
    assert figures.contacts.recall.count == figures.contacts.recall.total == 4
    assert figures.contacts.events_per_contact == 1
    assert figures.false_alarms.count == 0
    assert figures.contacts.visible_latency_s.mean < 0.17
    assert abs(figures.contacts.onset_error_s.mean) < 0.04
    error = np.array([rms for _, _, rms in runs])  # (4, 3)
    assert (np.sqrt((error**2).mean(axis=0)) < (0.65, 0.80, 0.80)).all()  # the robot's own estimate is no better
