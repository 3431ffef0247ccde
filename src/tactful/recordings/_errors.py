"""The error that every bad recording ends in."""

from __future__ import annotations

from pathlib import Path

from tactful.errors import TactfulError


class RecordingError(TactfulError):
    """A recording, or its mapping, cannot be used; the message is one line that says what, where and what to do.

    Attributes:
        path: the file, or None for a recording built in memory.
        line: the line in a text file, counted from 1.
        column: the name of the column, or its index from 0 where the file has no header.
        channel: the canonical channel that was being built.
    """

    def __init__(
        self,
        message: str,
        *,
        path: str | Path | None = None,
        line: int | None = None,
        column: str | int | None = None,
        channel: str | None = None,
    ) -> None:
        self.path = None if path is None else str(path)
        self.line = line
        self.column = column
        self.channel = channel
        place = "" if self.path is None else f"{self.path}: "
        if line is not None:
            place += f"line {line}: "
        super().__init__(" ".join((place + message).split()))
