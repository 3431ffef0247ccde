"""Hand-over from the loop to whoever wants to know, without waiting for anyone."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tactful.live._source import Sample
from tactful.monitor import ContactEvent

Array = NDArray[np.float64]

_MARGIN = 64
"""Rows that may be written while a reader copies."""
_EVENTS = 4096


@dataclass(frozen=True)
class Batch:
    """What came since the last look.

    Attributes:
        t: times (N,) [s].
        channels: name -> values (N, k), those that the source has.
        events: events, in their order, each with the time at which it was told [s].
        missed: samples that were overwritten before this look; 0 unless the reader was away for seconds.
    """

    t: Array
    channels: dict[str, Array]
    events: tuple[tuple[float, ContactEvent], ...]
    missed: int


class Feed:
    """A ring of the last samples and events, with one writer and any number of readers in other threads.

    The writer never waits: a reader that is too slow misses rows, and is told how many.

    Args:
        first: the first sample; its channels are those of the feed.
        rate_hz: nominal rate [Hz].
        seconds: how far back the ring reaches [s].
    """

    def __init__(self, first: Sample, rate_hz: float, seconds: float = 8.0) -> None:
        given = {name: value for name, value in zip(first._fields[1:], first[1:], strict=True) if value is not None}
        self.widths = {name: int(np.size(value)) for name, value in given.items()}
        self._size = max(1024, 2 ** math.ceil(math.log2(seconds * rate_hz)))
        self._ring = np.zeros((self._size, 1 + sum(self.widths.values())))
        self.columns: dict[str, slice] = {}
        begin = 1
        for name, width in self.widths.items():
            self.columns[name] = slice(begin, begin + width)
            begin += width
        self._order = [(first._fields.index(name), self._ring[:, part]) for name, part in self.columns.items()]
        self._t = self._ring[:, 0]
        self.written = 0
        self.told = 0
        self._events: deque[tuple[int, float, ContactEvent]] = deque(maxlen=_EVENTS)
        self.closed = False

    def put(self, sample: Sample, event: ContactEvent | None) -> None:
        """Add a sample, and the event that came with it."""
        row = self.written % self._size
        self._t[row] = sample.t
        for place, column in self._order:
            column[row] = sample[place]
        if event is not None:
            self._events.append((self.told, sample.t, event))
            self.told += 1
        self.written += 1

    def close(self) -> None:
        """Say that nothing will follow."""
        self.closed = True

    def subscribe(self, *, past: bool = True) -> Subscription:
        """Return a reader, from the beginning of the ring or from now on."""
        return Subscription(self, past)

    def _rows(self, start: int, stop: int) -> Array:
        rows: Array = self._ring[np.arange(start, stop) % self._size]
        return rows

    def _told(self, start: int, stop: int) -> list[tuple[float, ContactEvent]]:
        while stop > start:
            try:
                return [(t, event) for number, t, event in self._events if start <= number < stop]
            except RuntimeError:  # one was added while it was copied
                continue
        return []


class Subscription:
    """A reader of a feed, to be used in one thread."""

    def __init__(self, feed: Feed, past: bool) -> None:
        self._feed = feed
        self._row = max(0, feed.written - feed._size + _MARGIN) if past else feed.written
        self._event = 0 if past else feed.told

    def read(self) -> Batch:
        """Return what came since the last call, which may be nothing."""
        feed = self._feed
        told = feed.told
        stop = feed.written
        start = max(self._row, stop - feed._size + _MARGIN)
        rows = feed._rows(start, stop)  # (N, 1 + widths)
        overwritten = max(0, feed.written - feed._size - start + 1)  # while they were copied
        rows = rows[overwritten:]
        missed = start - self._row + overwritten
        events = feed._told(self._event, told)
        self._row, self._event = stop, told
        channels = {name: rows[:, part] for name, part in feed.columns.items()}
        return Batch(rows[:, 0], channels, tuple(events), missed)
