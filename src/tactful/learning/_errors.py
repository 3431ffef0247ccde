"""The error of data that does not suffice."""

from __future__ import annotations

from tactful.errors import TactfulError


class LearningError(TactfulError):
    """Labelled contacts from which nothing can be learned."""
