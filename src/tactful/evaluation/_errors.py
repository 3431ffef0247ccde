"""The error of truth that does not fit."""

from __future__ import annotations

from tactful.errors import TactfulError


class EvaluationError(TactfulError):
    """Labels or contacts that do not fit a recording.

    Attributes:
        source: the recording, "" where it has no name.
    """

    def __init__(self, message: str, *, source: str = "") -> None:
        self.source = source
        super().__init__(f"{source}: {message}" if source else message)
