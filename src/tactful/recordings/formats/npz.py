"""NumPy archives: `t` or `time` and a channel an array, or a column an array."""

from __future__ import annotations

import json
import zlib
from pathlib import Path
from typing import TYPE_CHECKING
from zipfile import BadZipFile

import numpy as np
from numpy.typing import NDArray

from tactful.recordings._errors import RecordingError
from tactful.recordings._table import Table

if TYPE_CHECKING:
    from tactful.recordings._recording import Recording

SUFFIX = ".npz"
META = "tactful"


def matches(head: bytes) -> bool:
    """A zip archive, or a lone array, for which there is advice."""
    return head.startswith((b"PK\x03\x04", b"PK\x05\x06", b"\x93NUMPY"))


def open_table(path: Path) -> Table:
    """Arrays of an archive; none is unpickled.

    Raises:
        RecordingError: a lone `.npy` array, an array of objects, arrays of different lengths.
    """
    with path.open("rb") as file:
        if file.read(6) == b"\x93NUMPY":
            raise RecordingError(
                "a lone .npy array has no column names: save a dict of arrays with np.savez('log.npz', **log)",
                path=path,
            )
        file.seek(0)
        try:
            with np.load(file, allow_pickle=False) as archive:
                arrays = {name: archive[name] for name in archive.files}
        except (BadZipFile, zlib.error) as error:
            raise RecordingError(f"the archive is torn: {error}", path=path) from None
    meta = json.loads(str(arrays.pop(META))) if META in arrays else None
    longest = max((len(array) for array in arrays.values() if array.ndim), default=0)
    time = next((arrays[name] for name in ("t", "time", "timestamp") if name in arrays and arrays[name].ndim), None)
    rows = longest if time is None else len(time)
    columns: dict[str, NDArray[np.generic]] = {}
    skipped = []
    for name, array in arrays.items():
        if array.ndim in (1, 2) and array.dtype.kind in "fiubU" and len(array) == rows:
            columns[name] = array
        elif array.ndim == 3 and array.dtype.kind in "fiub" and len(array) == rows:
            columns[name] = array.reshape(rows, -1)
        else:
            skipped.append(f"{name} {array.shape}")
    if not columns:
        raise RecordingError("the archive holds no columns: save time, q, dq, tau, ... as arrays of N rows", path=path)
    return Table(
        path=path,
        format="npz",
        names=tuple(columns),
        rows=rows,
        load=lambda name: columns[name],
        load_text=lambda name: [str(value) for value in columns[name]],
        widths={name: array.shape[1] for name, array in columns.items() if array.ndim == 2},
        notes=(f"arrays without {rows} rows not read: {', '.join(skipped)}",) if skipped else (),
        meta=meta,
    )


def save(recording: Recording, path: Path) -> None:
    """Write `t`, the channels and, as text, labels and notes."""
    from tactful.recordings._labels_file import to_json

    arrays = {"t": recording.t, **recording.channels, META: np.array(to_json(recording))}
    with path.open("wb") as file:
        np.savez(file, allow_pickle=False, **arrays)
