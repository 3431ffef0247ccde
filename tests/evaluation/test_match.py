"""Matching on timelines whose answer is known, and what holds for any."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tactful import ContactEvent, Label
from tactful.evaluation import EARLY_S, LATE_S, match_events
from tests.evaluation._made import event

times = st.floats(0, 10, allow_nan=False).map(lambda t: round(t, 3))
kinds = st.sampled_from(["collision", "cooperation", "contact"])
events = st.builds(lambda t, kind: event(t, kind=kind), times, kinds)
labels = st.builds(lambda a, b, kind: Label(kind, min(a, b), max(a, b)), times, times, kinds)


def test_first_event_finds_the_contact() -> None:
    """The plainest case: found, with its latency, the error of its onset, and one event too many."""
    first, second, third = event(1.05, onset_s=1.01), event(1.3), event(5.0)
    matching = match_events([third, second, first], [Label("contact", 1.0, 1.4), Label("contact", 7.0, 8.0)])
    found, missed = matching.matches
    assert found.event is first
    assert found.extra == (second,)
    assert found.latency_s == pytest.approx(0.05)
    assert found.onset_error_s == pytest.approx(0.01)
    assert missed.event is missed.latency_s is missed.onset_error_s is None
    assert matching.false_alarms == (third,)


@pytest.mark.parametrize(
    ("detected_s", "found"),
    [(2.0 - EARLY_S, True), (2.0 - EARLY_S - 1e-6, False), (3.0 + LATE_S, True), (3.0 + LATE_S + 1e-6, False)],
)
def test_window_has_its_stated_ends(detected_s: float, found: bool) -> None:
    """The rule is part of every figure: its limits are where the documentation puts them."""
    matching = match_events([event(detected_s)], [Label("contact", 2.0, 3.0)])
    assert (matching.matches[0].event is not None) is found
    assert len(matching.false_alarms) == (not found)


def test_a_contact_within_another_takes_the_event() -> None:
    """A hand on an arm that still leans on an obstacle: the later cause explains the later event."""
    collision, hand = Label("collision", 1.0, 5.0), Label("cooperation", 3.0, 4.0)
    matching = match_events([event(1.1), event(3.1)], [hand, collision])
    assert [match.label for match in matching.matches] == [collision, hand]
    assert [match.latency_s for match in matching.matches] == pytest.approx([0.1, 0.1])


def test_between_two_contacts_the_nearer_takes_the_event() -> None:
    """A late event of one contact is not the early event of the next."""
    contacts = [Label("contact", 1.0, 2.0), Label("contact", 2.1, 3.0)]
    late = match_events([event(2.04)], contacts, early_s=0.1)
    assert [match.event is not None for match in late.matches] == [True, False]
    early = match_events([event(2.06)], contacts, early_s=0.1)
    assert [match.event is not None for match in early.matches] == [False, True]


def test_an_alarm_that_goes_on_through_a_contact_finds_nothing() -> None:
    """A monitor that says contact all the time must not be called good."""
    matching = match_events([event(0.5, end_s=None)], [Label("contact", 2.0, 3.0)])
    assert matching.matches[0].event is None
    assert len(matching.false_alarms) == 1


def test_latency_from_the_visible_onset() -> None:
    """A slow push cannot be seen when it begins: both latencies are told."""
    label = Label("contact", 1.0, 2.0, visible_s=1.2)
    match = match_events([event(1.25)], [label]).matches[0]
    assert match.latency_s == pytest.approx(0.25)
    assert match.visible_latency_s == pytest.approx(0.05)


@pytest.mark.parametrize(
    ("labelled", "called", "right"),
    [
        ("collision", "collision", True),
        ("collision", "cooperation", False),
        ("collision", "contact", False),
        ("contact", "collision", None),
        ("impact", "collision", None),
    ],
)
def test_kind_is_judged_where_the_label_tells_it(labelled: str, called: str, right: bool | None) -> None:
    """An unclassified event is no right answer, and a label that does not tell the kind judges none."""
    match = match_events([event(1.1, kind=called)], [Label(labelled, 1.0, 2.0)]).matches[0]
    assert match.kind_right is right


@pytest.mark.parametrize(
    ("link", "named", "right"), [(1, "b", True), (0, "b", False), (None, "b", None), (1, None, None), (7, "b", None)]
)
def test_link_is_judged_where_both_tell_it(link: int | None, named: str | None, right: bool | None) -> None:
    """Links are indices in labels and names in events; a wrong one counts, an unknown one does not."""
    labels = [Label("contact", 1.0, 2.0, link)]
    assert match_events([event(1.1, link=named)], labels, link_names=("a", "b")).matches[0].link_right is right


@given(st.lists(events, max_size=12), st.lists(labels, max_size=8))
def test_matching_is_one_to_one_and_loses_nothing(events: list[ContactEvent], labels: list[Label]) -> None:
    """Every label appears once, and every event is a find, an extra or a false alarm, once."""
    matching = match_events(events, labels)
    assert sorted(map(repr, labels)) == sorted(repr(match.label) for match in matching.matches)
    placed = [e for match in matching.matches for e in (match.event, *match.extra) if e is not None]
    assert sorted(map(repr, (*placed, *matching.false_alarms))) == sorted(map(repr, events))
    for match in matching.matches:
        mine = [e for e in (match.event, *match.extra) if e is not None]
        assert mine == sorted(mine, key=lambda e: e.detected_s)
        assert all(match.label.start_s - EARLY_S <= e.detected_s <= match.label.end_s + LATE_S for e in mine)


@given(st.lists(events, max_size=8), st.lists(labels, max_size=6), st.randoms(use_true_random=False))
def test_order_of_input_does_not_matter(events: list[ContactEvent], labels: list[Label], random: object) -> None:
    """Files are read in any order; the figures must not depend on it."""
    shuffled_events, shuffled_labels = list(events), list(labels)
    random.shuffle(shuffled_events)  # type: ignore[attr-defined]
    random.shuffle(shuffled_labels)  # type: ignore[attr-defined]

    def picture(matching: object) -> str:
        return repr(matching)

    again = match_events(shuffled_events, shuffled_labels)
    first = match_events(events, labels)
    assert [m.label for m in first.matches] == [m.label for m in again.matches]
    assert [m.latency_s for m in first.matches] == [m.latency_s for m in again.matches]
    assert [len(m.extra) for m in first.matches] == [len(m.extra) for m in again.matches]
    assert [e.detected_s for e in first.false_alarms] == [e.detected_s for e in again.false_alarms]
