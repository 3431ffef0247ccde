"""The monitor on recordings whose contacts are known exactly."""

import copy
import pickle
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from tactful import ContactEvent, Monitor, MonitorConfig, Recording, Robot
from tactful.classification import Evidence, Onset, Verdict
from tactful.dynamics import Dynamics
from tactful.errors import TactfulError
from tactful.monitor import Health, Timeline
from tests.monitor._touched import Touch, recording

# Home of the Panda swings about the vertical: the tip moves along +y.
PAPER = MonitorConfig(mode="paper")
COLLISION = Touch(1.0, 1.4, (0.0, -20.0, 0.0))
PUSH = Touch(2.5, 3.2, (18.0, 0.0, 0.0), rise_s=0.05)


@pytest.fixture(scope="module")
def panda() -> Robot:
    """The arm of the papers."""
    return Robot.load("panda")


@pytest.fixture(scope="module")
def touched(panda: Robot) -> Recording:
    """Four seconds with a collision and then a push."""
    return recording(panda, COLLISION, PUSH, noise_nm=0.02)


@pytest.fixture(params=["fast", "paper"])
def config(request: pytest.FixtureRequest) -> MonitorConfig:
    """Both detectors: what is tested with this fixture holds for either."""
    return MonitorConfig(mode=request.param)


def stream(monitor: Monitor, samples: Recording, rows: range | None = None) -> list[ContactEvent]:
    """Take the rows of a recording one by one."""
    assert samples.q is not None
    assert samples.dq is not None
    assert samples.tau is not None
    events = (
        monitor.update(samples.t[k], samples.q[k], samples.dq[k], samples.tau[k])
        for k in (rows or range(len(samples.t)))
    )
    return [event for event in events if event is not None]


def changed(samples: Recording, **channels: Any) -> Recording:
    """Return a copy with other channels or times."""
    t = channels.pop("t", samples.t)
    kept = {name: np.array(values) for name, values in samples.channels.items()}
    return Recording(t=np.array(t), channels={**kept, **channels}, source=samples.source, format=samples.format)


def test_a_collision_and_a_push_are_told_apart(panda: Robot, touched: Recording, config: MonitorConfig) -> None:
    """The whole chain on the plainest recording: two contacts, each of its kind, with time, force and direction."""
    timeline = Monitor(panda, config).run(touched)
    assert [event.kind for event in timeline] == ["collision", "cooperation"]
    for event, touch in zip(timeline, (COLLISION, PUSH), strict=True):
        assert event.phase == "ended"
        assert abs(event.onset_s - touch.start_s) < 0.03
        assert event.onset_s <= event.detected_s < touch.start_s + 0.1
        assert event.end_s == pytest.approx(touch.end_s, abs=0.05)
        assert event.peak_force_n == pytest.approx(np.linalg.norm(touch.force_n), rel=0.1)
        assert event.directions[0] == "xy"[int(np.argmax(np.abs(touch.force_n)) == 1)]
        assert event.velocity_m_s is not None
        assert np.sign(event.velocity_m_s[1]) == np.sign(np.cos(2 * np.pi / 8 * touch.start_s))
        assert event.sigma_min is not None
        assert event.sigma_min > 0.05
        assert 0.5 < event.confidence <= 1
        assert event.evidence[0].text.startswith(event.kind)
    assert not timeline.health.degraded


def test_stream_is_batch_bit_for_bit(panda: Robot, touched: Recording, config: MonitorConfig) -> None:
    """One code path: the events of `update` folded over the rows are those of `run`, and so is all the state."""
    batch, single = Monitor(panda, config), Monitor(panda, config)
    timeline = batch.run(touched, trace=True)
    events = stream(single, touched)
    latest = {event.id: event for event in events}
    assert tuple(latest.values()) == timeline.events
    for name in ("record", "history"):
        assert getattr(batch._memory, name).tobytes() == getattr(single._memory, name).tobytes()
    phases = [event.phase for event in events if event.id == 0]
    assert (phases[0], phases[-1]) == ("began", "ended")
    assert "changed" in phases


def test_run_in_pieces_is_run_at_once(panda: Robot, touched: Recording, config: MonitorConfig) -> None:
    """A monitor goes on where it is, so a long log can be taken in parts."""
    whole, pieces = Monitor(panda, config), Monitor(panda, config)
    timeline = whole.run(touched)
    latest = {event.id: event for part in ((0, 1.05), (1.05, 4)) for event in pieces.run(touched.between(*part))}
    assert tuple(latest.values()) == timeline.events


@pytest.mark.parametrize("duplicate", [copy.copy, copy.deepcopy, lambda monitor: pickle.loads(pickle.dumps(monitor))])
def test_a_copy_of_a_running_monitor_goes_on_identically(
    panda: Robot, touched: Recording, config: MonitorConfig, duplicate: Any
) -> None:
    """In the middle of a contact, and without a memory in common with the original."""
    original = Monitor(panda, config)
    stream(original, touched, range(1200))
    assert original.contact is not None
    twin = duplicate(original)
    rest = range(1200, len(touched.t))
    assert stream(twin, touched, rest) == stream(original, touched, rest) != []


def test_the_force_is_that_of_the_contact_whatever_the_bias(
    panda: Robot, touched: Recording, config: MonitorConfig
) -> None:
    """A constant offset of the torque sensors of 1 Nm is not contact and not in the force of a contact."""
    assert touched.tau is not None
    plain = Monitor(panda, config).run(touched)
    biased = Monitor(panda, config).run(changed(touched, tau=touched.tau + 1.0))
    assert [event.kind for event in biased] == [event.kind for event in plain]
    for one, other in zip(plain, biased, strict=True):
        assert other.peak_force_n == pytest.approx(one.peak_force_n, rel=0.03)


def test_the_robots_own_external_torque_takes_the_place_of_the_observer(
    panda: Robot, touched: Recording, config: MonitorConfig
) -> None:
    """With `tau_ext` the observer is skipped; the exact external torque gives the same contacts."""
    assert touched.q is not None
    dynamics = Dynamics(panda)
    force = COLLISION.at(touched.t) + PUSH.at(touched.t)
    tau_ext = np.array([dynamics.jacobian(q)[:3].T @ F for q, F in zip(touched.q, force, strict=True)])
    channels = {"q": touched.q, "dq": touched.channels["dq"], "tau_ext": tau_ext}
    timeline = Monitor(panda, config).run(Recording(t=touched.t, channels=channels, source="ext", format="made"))
    assert [event.kind for event in timeline] == ["collision", "cooperation"]
    np.testing.assert_allclose(timeline.events[1].peak_force_n, 18.0, rtol=1e-3)


def test_a_wrench_alone_gives_contacts_without_a_kind(touched: Recording) -> None:
    """Without a robot and without motion, contact is all that can be said."""
    wrench = np.concatenate([COLLISION.at(touched.t) + PUSH.at(touched.t), np.zeros((len(touched.t), 3))], axis=1)
    timeline = Monitor().run(Recording(t=touched.t, channels={"wrench": wrench}, source="wrench", format="made"))
    assert [event.kind for event in timeline] == ["contact", "contact"]
    for event in timeline:
        assert event.velocity_m_s is None
        assert event.sigma_min is None
        assert event.torque_ext_nm == ()
        assert "velocity" in event.evidence[0].text


def test_torque_without_velocity_is_not_enough_for_the_observer(panda: Robot, touched: Recording) -> None:
    """The observer needs dq; the message says so instead of differentiating in silence."""
    assert touched.q is not None
    channels = {"q": touched.q, "tau": touched.channels["tau"]}
    with pytest.raises(TactfulError, match="tau needs q, dq, tau"):
        Monitor(panda).run(Recording(t=touched.t, channels=channels, source="log", format="made"))


def test_bad_samples_are_counted_skipped_and_forgotten(panda: Robot, touched: Recording, config: MonitorConfig) -> None:
    """A few samples of nonsense in a contact change neither the contacts nor their number."""
    q, dq, tau = (np.array(touched.channels[name]) for name in ("q", "dq", "tau"))
    t = np.array(touched.t)
    q[1100, 3] = np.nan
    dq[1205, 0] = np.inf
    tau[300, 6] = -np.inf
    t[2000] = t[1999]
    t[2700] = t[2690]
    t[3500] = np.nan
    monitor = Monitor(panda, config)
    timeline = monitor.run(changed(touched, q=q, dq=dq, tau=tau, t=t))
    assert timeline.health == Health(samples=4000, nonfinite=4, backward=2, gaps=0, repeated=0)
    assert [event.kind for event in timeline] == ["collision", "cooperation"]
    assert timeline.health.degraded
    assert monitor.degraded


def test_degraded_is_over_after_a_second(panda: Robot, touched: Recording) -> None:
    """The monitor recovers by itself and says so."""
    assert touched.tau is not None
    tau = np.array(touched.tau)
    tau[700] = np.nan
    bad = changed(touched, tau=tau)
    monitor = Monitor(panda)
    stream(monitor, bad, range(1600))
    assert monitor.degraded
    stream(monitor, bad, range(1600, 1750))
    assert not monitor.degraded


def test_a_gap_ends_the_contact_and_starts_anew(panda: Robot, touched: Recording, config: MonitorConfig) -> None:
    """After a second without samples nothing is known of the contact that was there, nor is the jump a contact."""
    keep = (touched.t < 1.2) | (touched.t > 3.25)
    gap = Recording(
        t=touched.t[keep],
        channels={name: values[keep] for name, values in touched.channels.items()},
        source="gap",
        format="made",
    )
    monitor = Monitor(panda, config)
    timeline = monitor.run(gap)
    assert timeline.health.gaps == 1
    assert [event.kind for event in timeline] == ["collision"]
    assert timeline.events[0].end_s == pytest.approx(1.199)


def test_repeated_rows_are_counted_and_do_no_harm(panda: Robot, touched: Recording, config: MonitorConfig) -> None:
    """A logger that repeats 6 % of the rows, as a real one does, gives the same contacts."""
    rng = np.random.default_rng(3)
    index = np.arange(len(touched.t))
    held = np.flatnonzero(rng.random(len(index)) < 0.06)
    index[held] = np.maximum(held - 1, 0)
    rows = {name: np.array(values)[index] for name, values in touched.channels.items()}
    timeline = Monitor(panda, config).run(changed(touched, **rows))
    assert timeline.health.repeated > 150
    assert not timeline.health.degraded
    assert [event.kind for event in timeline] == ["collision", "cooperation"]


def test_the_first_window_is_silent(panda: Robot) -> None:
    """A contact that is there from the start, or a bias, makes no event while the window fills."""
    always = Touch(-1.0, 9.0, (30.0, 0.0, 0.0))
    monitor = Monitor(panda)
    assert len(monitor.run(recording(panda, always, duration_s=1.5))) == 0
    assert monitor.ready


def test_one_impact_over_several_axes_is_one_contact(panda: Robot) -> None:
    """A collision whose force turns by and by stays one event that grows by a direction."""
    rec = recording(
        panda, Touch(1.0, 2.0, (0, -25.0, 0), rise_s=0.02), Touch(1.1, 2.0, (0, 0, 20.0), rise_s=0.02), duration_s=3.0
    )
    timeline = Monitor(panda, PAPER).run(rec)
    assert len(timeline) == 1
    assert timeline.events[0].kind == "collision"
    assert set(timeline.events[0].directions) >= {"y", "z"}
    apart = MonitorConfig(mode="paper", contact={"merge_s": 0.0})
    assert len(Monitor(panda, apart).run(rec)) > 1


def test_a_change_says_something_new(panda: Robot, touched: Recording, config: MonitorConfig) -> None:
    """While an impact grows, every sample is above the threshold: a listener must not be told the same each time."""
    told: dict[int, ContactEvent] = {}
    for event in stream(Monitor(panda, config), touched):
        if event.phase == "changed":
            assert event != replace(told[event.id], phase="changed", peak_force_n=event.peak_force_n)
        told[event.id] = event
    assert told


def test_help_in_a_collision_replaces_it_by_cooperation(panda: Robot) -> None:
    """COLL -> COOP, the transition that the paper adds: the old event ends where the new one begins."""
    rec = recording(panda, Touch(0.8, 3.0, (0, -25.0, 0)), Touch(1.4, 3.0, (20.0, 0, 0)))
    events = [event for event in stream(Monitor(panda, PAPER), rec) if event.phase != "changed"]
    assert [(event.kind, event.phase) for event in events] == [
        ("collision", "began"),
        ("cooperation", "began"),
        ("collision", "ended"),
        ("cooperation", "ended"),
    ]
    assert events[2].end_s == events[1].onset_s
    assert Monitor(panda, PAPER).run(rec).events == (events[2], events[3])
    rules = MonitorConfig(classifier="kinesthetic")  # to a model, an arm that does not give way is not helped
    fast = Monitor(panda, rules).run(rec)
    assert [event.kind for event in fast] == ["collision", "cooperation"]
    assert fast.events[1].detected_s - 1.4 < 0.03


def test_an_open_contact_is_in_the_timeline(panda: Robot) -> None:
    """A recording that stops in a contact tells it with all that is known, its peak included."""
    timeline = Monitor(panda).run(recording(panda, Touch(1.0, 9.0, (0, -20.0, 0)), duration_s=2.0))
    assert timeline.events[0].end_s is None
    assert timeline.events[0].peak_force_n == pytest.approx(20, rel=0.05)


def test_another_classifier_is_one_class(panda: Robot, touched: Recording) -> None:
    """The protocol is one method; the monitor takes whatever answers it."""

    class AlwaysCooperation:
        def classify(self, onset: Onset) -> Verdict:
            return Verdict("cooperation", 1.0, (Evidence("always", len(onset.t), 0.0, "cooperation: always"),))

    timeline = Monitor(panda, classifier=AlwaysCooperation()).run(touched)
    assert {event.kind for event in timeline} == {"cooperation"}


@pytest.mark.parametrize(
    ("sample", "message"),
    [
        ({"q": np.zeros(6), "dq": np.zeros(7), "tau": np.zeros(7)}, "q has 6 numbers, but 7 are needed"),
        ({"q": np.zeros(7), "dq": np.zeros(7)}, "no external force can be estimated from q, dq"),
        ({"q": ["a"] * 7, "dq": np.zeros(7), "tau": np.zeros(7)}, "not numbers"),
        ({"q": 0.5, "dq": np.zeros(7), "tau": np.zeros(7)}, "q has 1 numbers, but 7 are needed"),
    ],
)
def test_a_sample_that_does_not_fit_is_one_clear_line(panda: Robot, sample: dict[str, Any], message: str) -> None:
    """What a caller gets wrong at first: the joint count, a missing channel, text."""
    with pytest.raises(TactfulError, match=message):
        Monitor(panda).update(0.0, **sample)


def test_a_channel_that_vanishes_is_said(panda: Robot) -> None:
    """The channels of the first sample are those of all."""
    monitor = Monitor(panda)
    zero = np.zeros(7)
    monitor.update(0.0, panda.home, zero, zero)
    with pytest.raises(TactfulError, match="sample without tau"):
        monitor.update(0.001, panda.home, zero)


def test_a_recording_of_another_robot_or_rate_is_refused(panda: Robot, touched: Recording) -> None:
    """Six joints are no Panda, and 1 kHz is not 100 Hz; both messages say what to do."""
    with pytest.raises(TactfulError, match=r"q has 7 columns, but ur5e has 6; choose the robot"):
        Monitor(Robot.load("ur5e")).run(touched)
    with pytest.raises(TactfulError, match=r"sampled at 1000 Hz, the monitor is set to 100 Hz; use config\.fitted_to"):
        Monitor(panda, MonitorConfig().fitted_to(100)).run(touched)


def test_the_literature_settings_differ_as_described(panda: Robot, touched: Recording) -> None:
    """All of the paper's own values can be set, and the collision then never becomes free motion."""
    paper = MonitorConfig(
        mode="paper",
        contact={"release_ratio": 1.0, "hold_s": 0, "release_force_n": None, "collision_to_free": False, "merge_s": 0},
        kinesthetic={"rule": "literal", "secant_s": 0, "velocity_s": 0, "standstill_m_s": 0},
    )
    timeline = Monitor(panda, paper).run(touched)
    assert timeline.events[0].kind in ("collision", "cooperation")
    assert timeline.events[0].detected_s == Monitor(panda, PAPER).run(touched).events[0].detected_s


@pytest.mark.parametrize("name", Robot.names())
def test_every_built_in_arm_is_monitored(name: str) -> None:
    """Six and seven joints, torque sensors on either side of the gear."""
    robot = Robot.load(name)
    timeline = Monitor(robot).run(recording(robot, Touch(1.0, 1.5, (0, 0, -25.0)), duration_s=2.0))
    assert len(timeline) == 1
    assert timeline.events[0].onset_s == pytest.approx(1.0, abs=0.02)
    np.testing.assert_allclose(timeline.events[0].peak_force_n, 25, rtol=0.1)


def test_ten_million_samples_without_drift() -> None:
    """Three hours of a wrench alone: the level of a constant force stays zero, and a contact at the end is found."""
    block = 1_000_000
    rng = np.random.default_rng(0)
    wrench = np.concatenate([3.0 + 0.05 * rng.normal(size=(block, 3)), np.zeros((block, 3))], axis=1)
    last = wrench.copy()
    last[-1000:-500, 2] -= 9.0
    monitor = Monitor(config=PAPER)
    for k in range(10):
        rec = Recording(
            t=(k * block + np.arange(block)) / 1000,
            channels={"wrench": last if k == 9 else wrench},
            source="long",
            format="made",
        )
        timeline: Timeline = monitor.run(rec)
        assert len(timeline) == (1 if k == 9 else 0)
    level = monitor._memory.recent(1)["level"][0]
    spectrum = np.abs(np.fft.rfft(last[-500:, :3], axis=0)) * 2 / 500
    np.testing.assert_allclose(level, spectrum[5:51].max(axis=0), atol=1e-12)
