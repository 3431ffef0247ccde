"""Intervals that someone marked in a recording."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields
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
        visible_s: when the force first reached a level at which it can be seen, usually 1 N, where known [s].
        peak_force_n: largest magnitude of the force, where known [N].

    Raises:
        RecordingError: no kind, times that are not finite or in the wrong order, a negative link or force.
    """

    kind: str
    start_s: float
    end_s: float
    link: int | None = None
    visible_s: float | None = None
    peak_force_n: float | None = None

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
        for name in ("visible_s", "peak_force_n"):
            value = getattr(self, name)
            if value is None:
                continue
            if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
                raise RecordingError(f"label {self.kind!r}: {name} is {value!r}, expected a finite number or none")
            object.__setattr__(self, name, float(value))
        if self.peak_force_n is not None and self.peak_force_n < 0:
            raise RecordingError(f"label {self.kind!r}: peak_force_n is {self.peak_force_n:g}, expected none below 0")

    @classmethod
    def from_dict(cls, data: object) -> Label:
        """A label from `{"kind", "start_s", "end_s"}` and what else is known, as it stands in a labels file."""
        if not isinstance(data, Mapping):
            raise RecordingError(f"a label is an object with kind, start_s and end_s, got {data!r:.60}")
        known = [field.name for field in fields(cls)]
        if extra := [str(key) for key in data if key not in known]:
            raise RecordingError(f"label: unknown key {extra[0]!r}, allowed are {', '.join(known)}")
        if missing := [key for key in ("kind", "start_s", "end_s") if key not in data]:
            raise RecordingError(f"label: {missing[0]!r} is missing, a label has kind, start_s, end_s and maybe link")
        return cls(**data)

    def to_dict(self) -> dict[str, Any]:
        """The label as JSON-ready data, without what is unknown."""
        return {key: value for key, value in asdict(self).items() if value is not None}
