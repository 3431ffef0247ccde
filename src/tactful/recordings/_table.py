"""Named columns as they stand in a file, before they have a meaning."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from difflib import get_close_matches
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tactful.recordings._errors import RecordingError

DECODING_ERRORS = (ValueError, TypeError, LookupError, ArithmeticError, EOFError, OSError, MemoryError, RuntimeError)
"""What a decoder may raise over a damaged file."""


@dataclass(frozen=True)
class Table:
    """Columns of a file, read when they are asked for.

    Attributes:
        path: the file.
        format: how it is stored, `csv`, `parquet`, ...
        names: names of the columns; `0, 1, ...` where there is no header.
        rows: number of rows.
        load: gives a column by name, (N,) or (N, k), float64.
        load_text: gives a column of text by name.
        widths: k of the columns that are blocks (N, k).
        header: whether the names come from the file.
        notes: what was found on opening.
        meta: what `save` wrote beside the columns: labels and notes.
    """

    path: Path
    format: str
    names: tuple[str, ...]
    rows: int
    load: Callable[[str], NDArray[Any]]
    load_text: Callable[[str], Sequence[str]]
    widths: Mapping[str, int] = field(default_factory=dict)
    header: bool = True
    notes: tuple[str, ...] = ()
    meta: object = None

    def __post_init__(self) -> None:
        seen: set[str] = set()
        for name in self.names:
            if name in seen:
                raise RecordingError(
                    f"two columns are called {name!r}: rename one of them", path=self.path, column=name
                )
            seen.add(name)
        if self.rows == 0:
            raise RecordingError("there are columns but no rows: the logger wrote nothing after them", path=self.path)

    def column(self, name: str) -> NDArray[np.float64]:
        """Values of a column, (N,) or (N, k)."""
        if name not in self.names:
            raise self.missing(name)
        try:
            values = np.asarray(self.load(name), dtype=np.float64)
        except DECODING_ERRORS as error:
            raise damaged(self.path, error, name) from error
        if values.ndim not in (1, 2) or len(values) != self.rows:
            raise RecordingError(
                f"column {name!r} has shape {values.shape}, expected {self.rows} rows", path=self.path, column=name
            )
        return values

    def missing(self, name: str) -> RecordingError:
        """The error for a column that is not there, with the nearest name."""
        if not self.header:
            hint = f"the file has no header and {len(self.names)} columns, counted from 0"
        elif near := get_close_matches(name, self.names, n=1, cutoff=0.5):
            hint = f"did you mean {near[0]!r}?"
        else:
            hint = f"it has {short_list(self.names)}"
        return RecordingError(f"there is no column {name!r}: {hint}", path=self.path, column=name)


def damaged(path: Path, error: Exception, column: str | None = None) -> RecordingError:
    """The error for what a decoder says of a damaged file."""
    what = str(error).strip().split("\n")[0][:160] or type(error).__name__
    where = "" if column is None else f"column {column!r}: "
    return RecordingError(f"{where}the file is damaged or not what it looks like: {what}", path=path, column=column)


def short_list(names: Sequence[str], limit: int = 8) -> str:
    """`a, b, c and 5 more`."""
    rest = len(names) - limit
    return ", ".join(names) if rest <= 1 else ", ".join(names[:limit]) + f" and {rest} more"
