"""The hand-over: nothing is lost between one writer and its readers, and who is too slow is told what was missed."""

import threading

import numpy as np

from tactful.live import Feed, Sample
from tests.reaction._events import told


def sample(k: int) -> Sample:
    """Return a sample whose every number tells its place."""
    return Sample(0.001 * k, np.full(2, k), np.full(2, -k), np.full(2, 2 * k))


def test_reader_gets_every_row_in_order() -> None:
    """A recording is made of these rows: none twice, none left out, whatever the rhythm of the reader."""
    feed = Feed(sample(0), 1000.0)
    reader = feed.subscribe()
    rows, events, k = [], [], 0
    for count in (0, 1, 7, 1000, 3, 0):
        for _ in range(count):
            feed.put(sample(k), told(id=k) if k % 100 == 0 else None)
            k += 1
        batch = reader.read()
        assert batch.missed == 0
        rows.append(batch.channels["q"][:, 0])
        events += [event.id for _, event in batch.events]
    np.testing.assert_array_equal(np.concatenate(rows), np.arange(k))
    assert events == list(range(0, k, 100))


def test_absent_reader_is_told_what_it_missed() -> None:
    """The writer does not wait; what is lost has to be known, not guessed."""
    feed = Feed(sample(0), 1000.0, seconds=1.0)
    reader = feed.subscribe()
    for k in range(5000):
        feed.put(sample(k), None)
    batch = reader.read()
    assert batch.missed + len(batch.t) == 5000
    assert len(batch.t) > 900
    np.testing.assert_array_equal(batch.channels["dq"][:, 1], -np.arange(5000 - len(batch.t), 5000))


def test_rows_are_whole_while_they_are_written() -> None:
    """Reader and writer run at once: no row may be half of one sample and half of another."""
    feed = Feed(sample(0), 1000.0)
    reader = feed.subscribe()
    total = 60_000
    writer = threading.Thread(target=lambda: [feed.put(sample(k), None) for k in range(total)])
    writer.start()
    seen = missed = 0
    while seen + missed < total:
        batch = reader.read()
        q = batch.channels["q"][:, 0]
        np.testing.assert_array_equal(q, np.arange(seen + missed + batch.missed, seen + missed + batch.missed + len(q)))
        np.testing.assert_array_equal(batch.channels["tau"][:, 1], 2 * q)
        seen, missed = seen + len(q), missed + batch.missed
    writer.join()
    assert seen > 0


def test_late_reader_may_begin_now() -> None:
    """A view that is opened later need not draw the past."""
    feed = Feed(sample(0), 1000.0)
    for k in range(10):
        feed.put(sample(k), told())
    reader = feed.subscribe(past=False)
    assert len(reader.read().t) == 0
    feed.put(sample(10), None)
    np.testing.assert_array_equal(reader.read().t, [0.01])
