"""Streams of Arrow record batches, as a live run writes them; one that breaks off is read up to there."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from tactful.recordings._errors import RecordingError
from tactful.recordings._table import Table

META = b"tactful"
TORN = "the stream was not closed: it is read up to its last whole batch, a quarter of a second at most is missing"


def matches(head: bytes) -> bool:
    """The mark that every message of a stream begins with."""
    return head.startswith(b"\xff\xff\xff\xff")


def open_table(path: Path) -> Table:
    """Columns of a stream of record batches.

    Raises:
        RecordingError: pyarrow is not installed, or there is no whole batch.
    """
    try:
        import pyarrow as pa
    except ImportError:
        raise RecordingError('an Arrow stream needs pyarrow: pip install "tactful[files]"', path=path) from None
    batches: list[Any] = []
    events: list[Any] = []
    notes: tuple[str, ...] = ()
    try:
        with path.open("rb") as file, pa.ipc.open_stream(file) as stream:
            schema = stream.schema
            try:
                for batch, said in stream.iter_batches_with_custom_metadata():
                    batches.append(batch)
                    events += json.loads(said[META])["events"] if said is not None and META in said else []
            except (pa.ArrowInvalid, OSError):
                notes = (TORN,)
            file.seek(max(0, path.stat().st_size - 8))
            if not notes and file.read(8) != b"\xff\xff\xff\xff\x00\x00\x00\x00":
                notes = (TORN,)
    except pa.ArrowInvalid as error:
        raise RecordingError(f"the stream is torn before its first batch: {error}", path=path) from None
    if not batches:
        raise RecordingError("the stream breaks off before its first batch: no rows were written", path=path)
    table = pa.Table.from_batches(batches, schema)
    meta = json.loads((schema.metadata or {}).get(META, b"{}"))
    return Table(
        path=path,
        format="arrow",
        names=tuple(schema.names),
        rows=table.num_rows,
        load=lambda name: np.asarray(table.column(name).cast(pa.float64(), safe=False).to_numpy(), dtype=np.float64),
        load_text=lambda name: [str(value or "") for value in table.column(name).to_pylist()],
        notes=notes,
        meta={**meta, "events": events},
    )
