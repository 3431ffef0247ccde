"""The contacts: what there is now, a strip of time, and a list in which each can be chosen to see its evidence."""

from __future__ import annotations

import html
from collections.abc import Callable
from typing import TYPE_CHECKING

from tactful.live.view._words import COLOURS, evidence_card, headline, onset, rgb, small
from tactful.monitor import ContactEvent

if TYPE_CHECKING:
    import viser

_ROWS = 6
_STRIP_S = 30.0
_WIDTH, _HEIGHT = 340, 44
_PRESS = "for (const b of document.querySelectorAll('button')) if ((' ' + b.textContent).includes(' {} ')) b.click()"
"""What a bar of the strip does: it presses the button of its contact in the list."""
_HINT = small("Choose a contact to see what decided.")
_NONE = "choose"


class Contacts:
    """The list of contacts.

    Args:
        server: the page.
        on_choose: what to do when a contact is chosen, or let go (None).
    """

    def __init__(self, server: viser.ViserServer, on_choose: Callable[[ContactEvent | None], None]) -> None:
        self._server, self._on_choose = server, on_choose
        self._events: dict[int, ContactEvent] = {}
        self._shown: list[ContactEvent] = []
        self._others: dict[str, int] = {}
        self._around_s: float | None = None
        self._chosen: int | None = None
        self._strip_html = ""
        gui = server.gui
        self._strip = gui.add_html("")
        self._buttons = [gui.add_button(" ", visible=False, hint="Show what decided") for _ in range(_ROWS)]
        self._more = gui.add_dropdown("Others", (_NONE,), visible=False, hint="Contacts that the list has no room for")
        self._evidence = gui.add_html(_HINT)
        for row, button in enumerate(self._buttons):
            button.on_click(self._choose(row))

        @self._more.on_update
        def _(event: viser.GuiEvent) -> None:
            if event.client is not None and self._more.value in self._others:
                self._pick(self._others[self._more.value])

        self.draw(0.0)

    @property
    def chosen(self) -> ContactEvent | None:
        """The contact that is chosen."""
        return None if self._chosen is None else self._events.get(self._chosen)

    def add(self, event: ContactEvent) -> None:
        """Take what is known of a contact now."""
        self._events[event.id] = event
        self.refresh()

    def set(self, events: tuple[ContactEvent, ...]) -> None:
        """Take all contacts of a recording."""
        self._events = {event.id: event for event in events}
        self.refresh()

    def at(self, t: float) -> ContactEvent | None:
        """Return the contact that is there, or was there last, at a time [s]."""
        before = [event for event in self._events.values() if event.detected_s <= t]
        return max(before, key=lambda event: event.detected_s) if before else None

    def at_time(self, t: float) -> None:
        """List the contacts about a time [s]."""
        self._around_s = t
        self.refresh()

    def refresh(self) -> None:
        """List the contacts, newest first; of a recording, those before the time that is looked at, and the next."""
        ordered = sorted(self._events.values(), key=lambda event: event.onset_s)
        t = self._around_s
        before = len(ordered) if t is None else sum(event.onset_s <= t + 1e-9 for event in ordered)
        last = max(before, min(_ROWS, len(ordered)))
        self._shown = ordered[max(0, last - _ROWS) : last][::-1]
        if (chosen := self.chosen) is not None and chosen not in self._shown:
            self._shown = [*self._shown[: _ROWS - 1], chosen]
        for row, button in enumerate(self._buttons):
            event = self._shown[row] if row < len(self._shown) else None
            button.visible = event is not None
            if event is not None:
                button.label = ("▸ " if event.id == self._chosen else "") + headline(event)
                button.color = rgb(event.kind)
        self._others = {headline(event): event.id for event in reversed(ordered) if event not in self._shown}
        options = (_NONE, *self._others)
        if self._more.options != options:
            self._more.options = options
        self._more.visible = bool(self._others)
        self._evidence.content = evidence_card(self.chosen) if self.chosen else _HINT

    def draw(self, now_s: float, start_s: float | None = None, end_s: float | None = None) -> None:
        """Draw the strip: the last half minute, or the span of a recording."""
        begin = max(0.0, now_s - _STRIP_S) if start_s is None else start_s
        end = begin + _STRIP_S if end_s is None else end_s
        content = _strip(list(self._events.values()), begin, end, now_s, self._chosen)
        if content != self._strip_html:
            self._strip.content = self._strip_html = content

    def _choose(self, row: int) -> Callable[[object], None]:
        def choose(_: object) -> None:
            if row < len(self._shown):
                self._pick(self._shown[row].id)

        return choose

    def _pick(self, number: int) -> None:
        """Choose a contact, or let go the one that is chosen."""
        self._chosen = None if number == self._chosen else number
        self.refresh()
        self._on_choose(self.chosen)


def _strip(events: list[ContactEvent], begin: float, end: float, now: float, chosen: int | None) -> str:
    scale = _WIDTH / max(end - begin, 1e-9)
    bars = []
    for event in events:
        stop = now if event.end_s is None else event.end_s
        if stop < begin or event.onset_s > end:
            continue
        x = max(0.0, (event.onset_s - begin) * scale)
        width = max(3.0, (min(stop, end) - begin) * scale - x)
        edge = " stroke='#1d2a35' stroke-width='1.5'" if event.id == chosen else ""
        title = html.escape(headline(event))
        bars.append(
            f"<rect x='{x:.1f}' y='6' width='{width:.1f}' height='20' rx='2' fill='{COLOURS[event.kind]}'{edge} "
            f"style='cursor:pointer' onpointerdown=\"{_PRESS.format(onset(event))}\"><title>{title}</title></rect>"
        )
    step = _nice((end - begin) / 6)
    first = -(-begin // step) * step
    marks = []
    while first <= end:
        x = (first - begin) * scale
        marks.append(f"<text x='{x:.1f}' y='40' font-size='10' fill='#7b8a97' text-anchor='middle'>{first:g}</text>")
        first += step
    x = min(max((now - begin) * scale, 0.0), _WIDTH)
    return (
        f"<svg role='img' aria-label='timeline of contacts' viewBox='-6 0 {_WIDTH + 12} {_HEIGHT}' style='width:100%'>"
        f"<rect x='0' y='6' width='{_WIDTH}' height='20' rx='3' fill='#eef1f4'/>{''.join(bars)}"
        f"<line x1='{x:.1f}' x2='{x:.1f}' y1='2' y2='30' stroke='#1d2a35' stroke-width='1.5'/>{''.join(marks)}</svg>"
    )


def _nice(step: float) -> float:
    for nice in (0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 60.0, 120.0, 300.0, 600.0):
        if nice >= step:
            return nice
    return 3600.0
