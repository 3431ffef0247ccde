"""Parquet: a column a channel's joint, or a list column a channel; read a column at a time, so that an hour fits."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from tactful.recordings._errors import RecordingError
from tactful.recordings._table import Table

if TYPE_CHECKING:
    from tactful.recordings._recording import Recording

SUFFIX = ".parquet"
META = b"tactful"


def matches(head: bytes) -> bool:
    """The four letters that every Parquet file begins with."""
    return head.startswith(b"PAR1")


def open_table(path: Path) -> Table:
    """Columns of a Parquet file.

    Raises:
        RecordingError: pyarrow is not installed, or the file is torn.
    """
    pa, pq = _pyarrow(path)
    file = pq.ParquetFile(path, page_checksum_verification=True)
    schema = file.schema_arrow
    names, widths, skipped = [], {}, []
    for column in schema:
        kind = column.type
        if pa.types.is_list(kind) or pa.types.is_large_list(kind) or pa.types.is_fixed_size_list(kind):
            first = file.read_row_group(0, columns=[column.name]).column(0) if file.num_row_groups else []
            widths[column.name] = len(first[0]) if len(first) and first[0].is_valid else 0
        elif pa.types.is_nested(kind):
            skipped.append(column.name)
            continue
        names.append(column.name)
    meta = (schema.metadata or {}).get(META)

    def load(name: str) -> NDArray[Any]:
        chunks = file.read(columns=[name], use_threads=False).column(0)
        if name in widths:
            return _block(chunks, widths[name])
        kind = chunks.type
        if pa.types.is_timestamp(kind) or pa.types.is_duration(kind):
            factor = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}[kind.unit]
            return np.asarray(chunks.cast(pa.int64()).to_numpy(), dtype=np.float64) * factor
        return np.asarray(chunks.cast(pa.float64(), safe=False).to_numpy(), dtype=np.float64)

    return Table(
        path=path,
        format="parquet",
        names=tuple(names),
        rows=file.metadata.num_rows,
        load=load,
        load_text=lambda name: [str(value or "") for value in file.read(columns=[name]).column(0).to_pylist()],
        widths=widths,
        notes=(f"nested columns not read: {', '.join(skipped)}",) if skipped else (),
        meta=None if meta is None else json.loads(meta),
    )


def save(recording: Recording, path: Path) -> None:
    """Write `time` and the channels, a column each; labels and notes go into the metadata."""
    from tactful.recordings._labels_file import to_json

    pa, pq = _pyarrow(path)
    columns = {"time": recording.t}
    for name, values in recording.channels.items():
        columns |= {f"{name}_{i}": values[:, i] for i in range(values.shape[1])}
    schema = pa.schema([(name, pa.float64()) for name in columns], metadata={META: to_json(recording).encode()})
    with pq.ParquetWriter(path, schema, write_page_checksum=True, use_dictionary=False) as writer:
        for start in range(0, len(recording), 1_000_000):
            part = [pa.array(np.ascontiguousarray(column[start : start + 1_000_000])) for column in columns.values()]
            writer.write_table(pa.Table.from_arrays(part, schema=schema))


def _block(chunks: Any, width: int) -> NDArray[np.float64]:
    lists = chunks.combine_chunks()
    flat = np.asarray(lists.flatten().cast("double", safe=False).to_numpy(zero_copy_only=False), dtype=np.float64)
    if flat.size != len(lists) * width or lists.null_count:
        raise ValueError(f"its lists are not all of length {width}")
    return flat.reshape(-1, width)


def _pyarrow(path: Path) -> tuple[Any, Any]:
    try:
        import pyarrow
        import pyarrow.parquet
    except ImportError:
        raise RecordingError('Parquet needs pyarrow: pip install "tactful[files]"', path=path) from None
    return pyarrow, pyarrow.parquet
