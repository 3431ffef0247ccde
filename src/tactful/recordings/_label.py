"""Intervals that someone marked in a recording."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from tactful.recordings._errors import RecordingError


@dataclass(frozen=True)
class Label:
    """What happened from `start_s` to `end_s`, as somebody who knows says.

    Attributes:
        kind: what it was, usually a kind of contact event: `contact`, `collision`, `cooperation`, ...
        start_s: where it begins, on the clock of the recording [s].
        end_s: where it ends [s], not before it begins.
        link: index of the touched link, where known.

    Raises:
        RecordingError: no kind, times that are not finite or in the wrong order, a negative link.
    """

    kind: str
    start_s: float
    end_s: float
    link: int | None = None

    def __post_init__(self) -> None:
        kind: object = self.kind
        if not isinstance(kind, str) or not kind.strip():
            raise RecordingError(f"a label needs a kind, got {self.kind!r}: name it, as in 'collision'")
        for name in ("start_s", "end_s"):
            value: object = getattr(self, name)
            if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
                raise RecordingError(f"label {self.kind!r}: {name} is {value!r}, expected a finite number [s]")
            object.__setattr__(self, name, float(value))
        if self.end_s < self.start_s:
            raise RecordingError(
                f"label {self.kind!r} ends at {self.end_s:g} s, before it begins at {self.start_s:g} s: swap them"
            )
        link: object = self.link
        if link is not None and (isinstance(link, bool) or not isinstance(link, int) or link < 0):
            raise RecordingError(f"label {self.kind!r}: link is {link!r}, expected an index from 0 or none")

    @classmethod
    def from_dict(cls, data: object) -> Label:
        """A label from `{"kind", "start_s", "end_s", "link"}`, as it stands in a labels file."""
        if not isinstance(data, Mapping):
            raise RecordingError(f"a label is an object with kind, start_s and end_s, got {data!r:.60}")
        known = {"kind", "start_s", "end_s", "link"}
        if extra := [str(key) for key in data if key not in known]:
            raise RecordingError(f"label: unknown key {extra[0]!r}, allowed are kind, start_s, end_s, link")
        if missing := [key for key in ("kind", "start_s", "end_s") if key not in data]:
            raise RecordingError(f"label: {missing[0]!r} is missing, a label has kind, start_s, end_s and maybe link")
        return cls(**data)

    def to_dict(self) -> dict[str, Any]:
        """The label as JSON-ready data, without `link` where it is unknown."""
        data = {"kind": self.kind, "start_s": self.start_s, "end_s": self.end_s}
        return data if self.link is None else {**data, "link": self.link}
