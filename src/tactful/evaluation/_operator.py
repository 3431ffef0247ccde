"""Who touched the arm in a recording."""

from __future__ import annotations

import re

from tactful.recordings import Recording

_OPERATOR = re.compile(r"\boperator[\"']?\s*[:=]\s*[\"']?([\w.-]+)", re.IGNORECASE)
_NOBODY = ("null", "none")


def operator_of(recording: Recording) -> str | None:
    """Return who touched the arm, as a note of the recording says it (`operator: name`); None where none does."""
    for note in recording.notes:
        found = _OPERATOR.search(note)
        if found and found[1].casefold() not in _NOBODY:
            return found[1]
    return None
