"""The one root of every error that a user of Tactful can cause."""

from collections.abc import Callable
from typing import Any, Self


class TactfulError(Exception):
    """What went wrong, where, and what to do about it, in one line.

    Every package derives its own errors from this class and gives them fields, so that a caller can act on the data
    and the command line can print the message and exit with 2.
    """

    def __reduce__(self) -> tuple[Callable[..., Self], tuple[Any, ...], dict[str, Any]]:
        """Pickle the message and the fields: children are built from fields, not from the message."""
        cls = type(self)
        return cls.__new__, (cls, *self.args), self.__dict__
