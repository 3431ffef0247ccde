"""Figures of timelines made by hand."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tactful import ContactEvent, Label, Recording
from tactful.evaluation import EARLY_S, LATE_S, EvaluationError, Figures, Share, by_operator, evaluate, grouped
from tests.evaluation._made import event, recording, timeline
from tests.evaluation.test_match import events, labels

MARGIN_S = EARLY_S + LATE_S


def test_known_figures() -> None:
    """Two recordings by hand: every figure can be counted on the fingers."""
    first = evaluate(
        recording(Label("collision", 1.0, 2.0), Label("cooperation", 4.0, 5.0)),
        timeline(
            event(1.1, kind="collision"),
            event(1.5, kind="cooperation"),
            event(4.3, kind="cooperation"),
            event(8.0, end_s=9.0),
        ),
    )
    second = evaluate(
        recording(Label("collision", 1.0, 2.0), Label("collision", 5.0, 6.0)),
        timeline(event(1.2, kind="cooperation")),
    )
    figures = Figures.of([first, second])
    assert figures.recordings == 2
    assert figures.contacts.recall == Share(3, 4)
    assert figures.contacts.missed == 1
    assert figures.contacts.latency_s.mean == pytest.approx(0.2)
    assert figures.contacts.latency_s.sd == pytest.approx(0.1)
    assert figures.contacts.onset_error_s.mean == pytest.approx(0.18)
    assert figures.contacts.events_per_contact == pytest.approx(4 / 3)
    assert figures.monitored_s == pytest.approx(20.0)
    assert figures.contact_free_s == pytest.approx(16 - 4 * MARGIN_S)
    assert figures.false_alarms.count == 1
    assert figures.false_alarms.per_hour == pytest.approx(3600 / figures.contact_free_s)
    assert figures.alarm_share == pytest.approx(1.0 / figures.contact_free_s)
    assert figures.specificity == Share(1, 2)
    assert figures.sensitivity == Share(1, 1)
    assert figures.accuracy == Share(2, 3)
    assert figures.spurious_cooperation == Share(1, 1)
    assert figures.confusion.counts == {
        "collision": {"collision": 1, "cooperation": 1},
        "cooperation": {"collision": 0, "cooperation": 1},
    }
    assert figures.confusion.missed == {"collision": 1, "cooperation": 0}


def test_figures_by_operator() -> None:
    """Whom a classifier understands is another question than how many contacts it does."""
    outcomes = [
        evaluate(replace(recording(Label("cooperation", 1.0, 2.0)), notes=(note,)), timeline(event(1.1, kind=kind)))
        for note, kind in (("operator: ada", "cooperation"), ("operator: bob", "collision"), ("no one", "collision"))
    ]
    figures = by_operator(outcomes)
    assert {name: each.sensitivity for name, each in figures.items()} == {"ada": Share(1, 1), "bob": Share(0, 1)}


def test_extra_cooperation_is_spurious_too() -> None:
    """One impact that retriggers the classifier reprograms the robot, although its first event was right."""
    outcome = evaluate(
        recording(Label("collision", 1.0, 2.0)), timeline(event(1.1, kind="collision"), event(1.4, kind="cooperation"))
    )
    figures = Figures.of([outcome])
    assert figures.specificity == Share(1, 1)
    assert figures.spurious_cooperation == Share(1, 1)


def test_no_recording_is_collision_only_without_a_collision() -> None:
    """Recordings without contact, or with a hand in them, say nothing about spurious cooperation."""
    free, helped = recording(), recording(Label("cooperation", 1.0, 2.0), Label("collision", 4.0, 5.0))
    outcomes = [evaluate(r, timeline(event(8.0, kind="cooperation"))) for r in (free, helped)]
    assert Figures.of(outcomes).spurious_cooperation == Share(0, 0)


def test_an_alarm_that_never_ends() -> None:
    """One alarm in ten seconds sounds better than it is: the share of time tells."""
    outcome = evaluate(recording(Label("contact", 4.0, 5.0)), timeline(event(0.0, end_s=None)))
    figures = Figures.of([outcome])
    assert figures.contacts.recall == Share(0, 1)
    assert figures.false_alarms.count == 1
    assert figures.alarm_share == pytest.approx(1.0)


def test_gaps_and_backward_time_are_no_monitored_time() -> None:
    """An hour that the logger was off must not dilute the false alarms."""
    t = np.concatenate([np.arange(0, 1.005, 0.01), np.arange(3601, 3602.005, 0.01), [3601.5, 3602.0, np.nan]])
    with_gap = Recording(t=t, channels={"wrench": np.zeros((len(t), 6))}, labels=(Label("contact", 0.9, 3601.5),))
    outcome = evaluate(with_gap, timeline(end_s=3602.0))
    assert outcome.monitored_s == pytest.approx(2.0)
    assert outcome.contact_free_s == pytest.approx(0.85 + 0.3)


@settings(deadline=None)  # the first interval imports scipy
@given(st.lists(st.tuples(st.lists(events, max_size=6), st.lists(labels, max_size=4)), min_size=1, max_size=3))
def test_counts_add_up(cases: list[tuple[list[ContactEvent], list[Label]]]) -> None:
    """Events and labels are neither lost nor counted twice, whatever they are, and shares are shares."""
    outcomes = [evaluate(recording(*labels), timeline(*events)) for events, labels in cases]
    figures = Figures.of(outcomes)
    recall, confusion = figures.contacts.recall, figures.confusion
    called = sum(sum(row.values()) for row in confusion.counts.values())
    assert called == recall.count
    assert called + sum(confusion.missed.values()) == recall.total == sum(len(labels) for _, labels in cases)
    extra = sum(len(match.extra) for outcome in outcomes for match in outcome.matches)
    assert recall.count + extra + figures.false_alarms.count == sum(len(events) for events, _ in cases)
    assert -1e-9 <= figures.contact_free_s <= figures.monitored_s == pytest.approx(10 * len(cases))
    assert all(-1e-9 <= outcome.alarm_s <= outcome.contact_free_s + 1e-9 for outcome in outcomes)
    groups = grouped(outcomes, lambda label: label.kind)
    assert sum(group.recall.count for group in groups.values()) == recall.count
    assert list(groups) == sorted(groups)


@settings(deadline=None)  # the first interval imports scipy
@given(st.lists(events, min_size=1, max_size=6), st.lists(labels, min_size=1, max_size=4))
def test_figures_go_to_json(events: list[ContactEvent], labels: list[Label]) -> None:
    """What is written is JSON that any reader takes: no nan."""
    import json

    outcome = evaluate(recording(*labels), timeline(*events))
    json.dumps([outcome.to_dict(), Figures.of([outcome]).to_dict()], allow_nan=False)


def test_nothing_evaluated() -> None:
    """No recordings, no figures: nan and empty shares, no division by zero."""
    figures = Figures.of([])
    assert math.isnan(figures.alarm_share)
    assert math.isnan(figures.contacts.events_per_contact)
    assert figures.contacts.recall == Share(0, 0)
    assert figures.to_dict()["alarm_share"] is None


@pytest.mark.parametrize(
    ("label", "message"),
    [
        (Label("colision", 1.0, 2.0), "label 'colision' from 1 to 2 s: unknown kind; did you mean 'collision'?"),
        (Label("xyz", 1.0, 2.0), "unknown kind; use one of contact, collision, cooperation"),
        (Label("contact", 11.0, 12.0), "from 11 to 12 s lies outside the recording, which spans 0 to 10 s"),
        (Label("contact", 9.0, 10.2), "lies outside the recording"),
        (Label("contact", -0.2, 1.0), "lies outside the recording"),
        (Label("contact", 1.0, 2.0, 3), "there is no link 3, the arm has links 0 to 1"),
    ],
)
def test_labels_that_do_not_fit_are_refused(label: Label, message: str) -> None:
    """A label on another clock, or with a slip in its kind, would silently become a miss."""
    with pytest.raises(EvaluationError) as caught:
        evaluate(recording(label), timeline(), link_names=("a", "b"))
    assert str(caught.value).startswith("made.csv: label")
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)
    assert caught.value.source == "made.csv"


def test_rounded_labels_fit() -> None:
    """A hand-made label that ends a little after the last row is no mistake."""
    outcome = evaluate(replace(recording(), labels=(Label("contact", 9.0, 10.05),)), timeline(event(9.1)))
    assert outcome.found == 1
