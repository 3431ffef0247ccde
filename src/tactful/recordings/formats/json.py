"""JSON: an object of columns, as `json.dump` writes the dict of lists that panda-py's log is."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tactful.recordings._errors import RecordingError
from tactful.recordings._table import Table


def matches(head: bytes) -> bool:
    """An opening brace."""
    return head.removeprefix(b"\xef\xbb\xbf").lstrip().startswith(b"{")


def open_table(path: Path) -> Table:
    """Columns of an object of lists; a list of lists is a block.

    Raises:
        RecordingError: no JSON, or no columns of one length.
    """
    try:
        data = json.loads(path.read_bytes().decode("utf-8-sig"))
    except json.JSONDecodeError as error:
        raise RecordingError(f"torn or no JSON: {error.msg}", path=path, line=error.lineno) from None
    columns: dict[str, NDArray[np.generic]] = {}
    for name, values in data.items():
        if not isinstance(values, list):
            continue
        try:
            array = np.array([np.nan if value is None else value for value in values])
        except ValueError:
            raise RecordingError(f"column {name!r} is ragged", path=path, column=name) from None
        if array.dtype.kind not in "fiubU" or array.ndim not in (1, 2):
            raise RecordingError(f"column {name!r} is not made of numbers, or of lists of them", path=path, column=name)
        columns[name] = array
    lengths = {name: len(array) for name, array in columns.items()}
    if len(set(lengths.values())) != 1:
        what = ", ".join(f"{name} {length}" for name, length in list(lengths.items())[:6]) or "none"
        raise RecordingError(f"expected an object of columns of one length, got {what}", path=path)
    return Table(
        path=path,
        format="json",
        names=tuple(columns),
        rows=next(iter(lengths.values())),
        load=lambda name: columns[name],
        load_text=lambda name: [str(value) for value in columns[name]],
        widths={name: array.shape[1] for name, array in columns.items() if array.ndim == 2},
    )
