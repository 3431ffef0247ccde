"""Injected contacts: that the signals show the force that is said, and that the seed says all."""

import itertools
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.signal import bilinear, lfilter

from tactful import Label, Monitor, Recording, Robot
from tactful.dynamics import Dynamics
from tactful.estimation import MomentumObserver, ObserverConfig
from tactful.evaluation import EvaluationError, InjectedContact, evaluate, inject, random_contacts
from tests._counterparts import require_shared_data
from tests.monitor._touched import Touch, recording

IMPACT = InjectedContact(kind="impact", start_s=1.0, end_s=1.04, force_n=(0.0, -40.0, 0.0))
PUSH = InjectedContact(
    kind="push", start_s=2.0, end_s=3.0, force_n=(12.0, 0.0, 9.0), link=3, point_m=(-0.05, 0.06, 0.02), rise_s=0.2
)


@pytest.fixture(scope="module")
def panda() -> Robot:
    """The arm of the papers."""
    return Robot.load("panda")


@pytest.fixture(scope="module")
def free(panda: Robot) -> Recording:
    """Four seconds of free motion at 1 kHz."""
    return recording(panda, noise_nm=0.05)


def torque(robot: Robot, contact: InjectedContact, samples: Recording) -> Any:
    """Return J^T F (N, n) as the difference of two exact poses would have it: by finite differences of the point."""
    assert samples.q is not None
    at = robot if contact.link is None else _touched_at(robot, contact)
    dynamics, step = Dynamics(at), 1e-6
    result = np.zeros_like(samples.q)
    for k in np.flatnonzero((samples.t >= contact.start_s) & (samples.t <= contact.end_s)):
        q = samples.q[k]
        for j in range(robot.n):
            moved = step * (np.arange(robot.n) == j)
            slope = (dynamics.pose(q + moved)[1] - dynamics.pose(q - moved)[1]) / (2 * step)  # (3,)
            result[k, j] = slope @ contact.force_at([samples.t[k]])[0]
    return result


def _touched_at(robot: Robot, contact: InjectedContact) -> Robot:
    tip = robot.frames[robot.tip]
    assert contact.link is not None
    frame = replace(tip, link=contact.link, rotation=np.eye(3), translation=np.array(contact.point_m))
    return replace(robot, frames={"touch": frame}, tip="touch")


@pytest.mark.parametrize("contact", [IMPACT, PUSH], ids=lambda contact: contact.kind)
def test_residual_shows_the_low_passed_force(panda: Robot, free: Recording, contact: InjectedContact) -> None:
    """The definition: the observer's residual changes by J^T F behind K/(s+K), with J by finite differences."""
    touched = inject(free, panda, [contact])
    before, after = (
        MomentumObserver(panda, ObserverConfig(bandwidth_hz=30.0)).run(r.t, r.q, r.dq, r.tau)  # type: ignore[arg-type]
        for r in (free, touched)
    )
    K = 2 * np.pi * 30.0
    expected = lfilter(*bilinear([K], [1, K], fs=1000.0), torque(panda, contact, free), axis=0)
    assert np.abs(expected).max() > 1.0
    np.testing.assert_allclose(after - before, expected, atol=1e-6)


def test_injecting_is_what_the_dynamics_would_have_given(panda: Robot) -> None:
    """A push that was simulated through the inverse dynamics and one that is injected afterwards are the same."""
    contact = replace(PUSH, link=None, force_n=(12.0, 0.0, 0.0))
    touched = inject(recording(panda), panda, [contact])
    steps = recording(panda, Touch(2.0, 3.0, (12.0, 0.0, 0.0), rise_s=0.2))
    flat = (touched.t > 2.2) & (touched.t < 2.8)
    np.testing.assert_allclose(touched.tau[flat], steps.tau[flat], atol=1e-9)  # type: ignore[index]


def test_course_of_the_force() -> None:
    """An impact is a half sine, a push rises, stays and falls; both pass 1 N when `visible_s` says so."""
    t = np.array([0.99, 1.0, 1.01, 1.02, 1.04, 1.05])
    np.testing.assert_allclose(IMPACT.force_at(t)[:, 1], [0, 0, -40 * np.sin(np.pi / 4), -40, 0, 0], atol=1e-9)
    t = np.array([1.9, 2.0, 2.1, 2.2, 2.5, 2.8, 2.9, 3.0, 3.1])
    share = np.linalg.norm(PUSH.force_at(t), axis=1) / 15
    np.testing.assert_allclose(share, [0, 0, 0.5, 1, 1, 1, 0.5, 0, 0], atol=1e-9)
    for contact in (IMPACT, PUSH):
        assert contact.visible_s is not None
        assert np.linalg.norm(contact.force_at([contact.visible_s])) == pytest.approx(1.0)
    assert replace(IMPACT, force_n=(0.5, 0.0, 0.0)).visible_s is None
    short = replace(PUSH, end_s=2.1)  # no time to rise for 0.2 s: it peaks in the middle
    assert np.linalg.norm(short.force_at([2.05])) == pytest.approx(15.0)


def test_labels_and_notes(panda: Robot, free: Recording) -> None:
    """The recording carries its truth, in order, and says that it is not as it was measured."""
    touched = inject(free, panda, [PUSH, IMPACT])
    assert [(label.kind, label.start_s, label.end_s, label.link) for label in touched.labels] == [
        ("impact", 1.0, 1.04, None),
        ("push", 2.0, 3.0, 3),
    ]
    assert "2 contacts injected" in touched.notes
    assert free.labels == ()
    np.testing.assert_array_equal(touched.t, free.t)
    np.testing.assert_array_equal(touched.q, free.q)  # type: ignore[arg-type]


def test_contacts_add_up(panda: Robot, free: Recording) -> None:
    """Forces superpose: together is one after the other."""
    overlapping = replace(PUSH, start_s=0.9, end_s=1.6)
    both = inject(free, panda, [IMPACT, overlapping])
    in_turn = inject(inject(free, panda, [IMPACT]), panda, [overlapping])
    np.testing.assert_allclose(both.tau, in_turn.tau, atol=1e-12)  # type: ignore[arg-type]


def test_the_robots_own_estimates(panda: Robot, free: Recording) -> None:
    """tau_ext rises by what tau falls; a force at the tip stands in the wrench as it is, without a moment."""
    zeros = {"tau_ext": np.zeros((len(free), 7)), "wrench": np.zeros((len(free), 6))}
    touched = inject(free.with_channels(**zeros), panda, [IMPACT])
    assert touched.tau is not None
    assert free.tau is not None
    np.testing.assert_allclose(touched.tau_ext, free.tau - touched.tau, atol=1e-12)  # type: ignore[arg-type]
    force = np.zeros((len(free), 6))
    force[:, :3] = IMPACT.force_at(free.t)
    np.testing.assert_allclose(touched.wrench, force, atol=1e-9)  # type: ignore[arg-type]


def test_wrench_alone() -> None:
    """Without joints, the force acts at the tip, and nothing about the arm needs to be known."""
    t = np.arange(0, 4, 0.0125)
    touched = inject(Recording(t=t, channels={"wrench": np.zeros((len(t), 6))}), None, [replace(PUSH, link=None)])
    np.testing.assert_allclose(touched.wrench[:, :3], PUSH.force_at(t), atol=1e-12)  # type: ignore[index]
    assert not touched.wrench[:, 3:].any()  # type: ignore[index]


def test_recorded_jacobian() -> None:
    """With torques but no posture, the recorded Jacobian tells what a force at the tip does."""
    t = np.arange(0, 4, 0.0125)
    J = np.random.default_rng(0).normal(size=(6, 7))
    channels = {"tau_ext": np.zeros((len(t), 7)), "jacobian": np.tile(J.ravel(), (len(t), 1))}
    touched = inject(Recording(t=t, channels=channels), None, [replace(PUSH, link=None)])
    np.testing.assert_allclose(touched.tau_ext, PUSH.force_at(t) @ J[:3], atol=1e-12)  # type: ignore[arg-type]


def test_stale_rows_stay_stale(panda: Robot, free: Recording) -> None:
    """Real logs repeat rows: an injected force must not betray which ones."""
    rows = np.arange(len(free))
    rows[1010:1030:5] -= 1
    stale = replace(free, channels={name: values[rows] for name, values in free.channels.items()})
    assert stale.quality.repeated_rows == 4
    assert inject(stale, panda, [IMPACT]).quality.repeated_rows == 4


def test_bad_rows_stay_bad(panda: Robot, free: Recording) -> None:
    """A row without a posture gets no force, and does not spread."""
    q = np.array(free.q)
    q[1020] = np.nan
    touched = inject(free.with_channels(q=q), panda, [IMPACT])
    np.testing.assert_array_equal(touched.tau[1020], free.tau[1020])  # type: ignore[index]
    assert np.isfinite(touched.tau).all()  # type: ignore[arg-type]


def test_random_contacts_keep_their_distance(panda: Robot, free: Recording) -> None:
    """Contacts that overlap, or that stand in the monitor's warm-up, would measure something else."""
    rng = np.random.default_rng(1)
    long = replace(free, t=5 * free.t)  # 20 s
    for _ in range(50):
        contacts = random_contacts(long, panda, rng, count=7)
        assert len(contacts) == 7
        assert contacts[0].start_s >= 1.0
        assert contacts[-1].end_s <= long.t[-1] - 0.5 + 1e-9
        assert all(b.start_s - a.end_s >= 0.5 - 1e-9 for a, b in itertools.pairwise(contacts))
        for contact in contacts:
            duration = contact.end_s - contact.start_s
            if contact.kind == "impact":
                assert 15 <= contact.peak_force_n <= 60
                assert 0.02 <= duration <= 0.06 + 1e-9
            else:
                assert 10 <= contact.peak_force_n <= 30
                assert 0.1 <= contact.rise_s <= 0.3
                assert 0.2 <= duration - 2 * contact.rise_s <= 0.8


def test_random_contacts_are_balanced_and_everywhere(panda: Robot, free: Recording) -> None:
    """Four are one of each kind and place; forces have no direction that they prefer."""
    long, rng = replace(free, t=5 * free.t), np.random.default_rng(2)
    drawn = [random_contacts(long, panda, rng) for _ in range(200)]
    places = {("impact", None), ("impact", 3), ("push", None), ("push", 3)}
    assert all({(contact.kind, contact.link) for contact in contacts} == places for contacts in drawn)
    one_by_one = [random_contacts(long, panda, rng, count=1, first=i)[0] for i in range(4)]
    assert {(contact.kind, contact.link) for contact in one_by_one} == places
    directions = np.array([np.array(c.force_n) / c.peak_force_n for contacts in drawn for c in contacts])
    assert np.abs(directions.mean(axis=0)).max() < 4 / np.sqrt(3 * len(directions))


def test_the_seed_says_all(panda: Robot, free: Recording) -> None:
    """A table that somebody else cannot make again is worth nothing."""
    long = replace(free, t=3 * free.t)
    one, same, other = (random_contacts(long, panda, np.random.default_rng(seed)) for seed in (5, 5, 6))
    assert one == same != other
    first, again = inject(long, panda, one), inject(long, panda, same)
    np.testing.assert_array_equal(first.tau, again.tau)  # type: ignore[arg-type]


def test_monitor_finds_what_was_injected(panda: Robot) -> None:
    """The way through: injected into a clean recording, contacts at the tip are found, each by its own event."""
    contacts = [IMPACT, replace(PUSH, link=None, rise_s=0.1, force_n=(0.0, 0.0, 25.0))]
    touched = inject(recording(panda, noise_nm=0.01), panda, contacts)
    outcome = evaluate(touched, Monitor(panda).run(touched), link_names=panda.link_names)
    assert outcome.found == 2
    assert outcome.false_alarms == ()
    assert all(0 < (match.latency_s or 0) < 0.1 for match in outcome.matches)


def test_injection_into_the_real_panda(panda: Robot) -> None:
    """On irregular stamps and repeated rows, tau changes by J^T F and by nothing else."""
    measured = Recording.read(require_shared_data() / "panda_free_motion" / "exciting_first_10s.csv")
    contacts = random_contacts(measured, panda, np.random.default_rng(0))
    touched = inject(measured, panda, contacts)
    assert touched.tau is not None
    assert measured.tau is not None
    assert touched.quality == measured.quality
    for contact in contacts:
        inside = (measured.t >= contact.start_s) & (measured.t <= contact.end_s)
        k = int(np.flatnonzero(inside)[inside.sum() // 2])
        if (measured.channels["q"][k] == measured.channels["q"][k - 1]).all():
            k += 1
        one = Recording(t=measured.t[k : k + 1], channels={"q": measured.channels["q"][k : k + 1]})
        np.testing.assert_allclose(
            measured.tau[k] - touched.tau[k], torque(panda, contact, one)[0], rtol=1e-6, atol=1e-6
        )
    outside = ~np.any([(measured.t >= c.start_s) & (measured.t <= c.end_s + 0.01) for c in contacts], axis=0)
    np.testing.assert_array_equal(touched.tau[outside], measured.tau[outside])


def without(samples: Recording, **channels: Any) -> Recording:
    """Return a recording with other channels alone."""
    return replace(samples, channels=channels)


@pytest.mark.parametrize(
    ("change", "contact", "message"),
    [
        (lambda r: r.with_channels(tau=None), IMPACT, "none of its channels (q, dq) shows a force"),
        (lambda r: r, replace(IMPACT, start_s=9.0, end_s=9.1), "from 9 to 9.1 s lies outside the recording"),
        (lambda r: r, replace(PUSH, link=7), "acts on link 7, but panda has links 0 to 6"),
        (lambda r: without(r, q=r.q[:, :6]).with_channels(tau=r.tau[:, :6]), IMPACT, "q has 6 columns, but panda has"),
        (lambda r: without(r, tau=r.tau), PUSH, "a push on link 3 needs q and a robot"),
        (lambda r: without(r, tau=r.tau), IMPACT, "through the Jacobian: give q and a robot, or the channel jacobian"),
    ],
)
def test_what_cannot_be_injected(
    panda: Robot, free: Recording, change: Any, contact: InjectedContact, message: str
) -> None:
    """One line that says what is missing, instead of a recording that shows something else."""
    with pytest.raises(EvaluationError) as caught:
        inject(change(free), panda, [contact])
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


def test_contacts_that_cannot_be() -> None:
    """A contact without duration or with nan would silently be none."""
    with pytest.raises(EvaluationError, match=r"the impact at 1 s is over at 1 s: give it some time"):
        replace(IMPACT, end_s=1.0)
    with pytest.raises(EvaluationError, match="not finite"):
        replace(IMPACT, force_n=(np.nan, 0.0, 0.0))


def test_where_no_contact_can_be_drawn(panda: Robot, free: Recording) -> None:
    """Too short a recording, none at all, and contacts that are there already."""
    rng = np.random.default_rng(0)
    with pytest.raises(EvaluationError, match=r"touched.csv: 9 contacts need .* it lasts 4.0 s: inject fewer"):
        random_contacts(free, panda, rng, count=9)
    with pytest.raises(EvaluationError, match="at least one"):
        random_contacts(free, panda, rng, count=0)
    with pytest.raises(EvaluationError, match="it has contacts already, the first at 2 s"):
        random_contacts(replace(free, labels=(Label("contact", 2.0, 3.0),)), panda, rng)
