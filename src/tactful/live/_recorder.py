"""The recorder: what comes in is on disk a quarter of a second later, whatever happens then."""

from __future__ import annotations

import json
import os
import threading
from pathlib import Path
from typing import Any, BinaryIO

from tactful.errors import TactfulError
from tactful.live._feed import Batch, Feed

_FLUSH_S = 0.25
_ROWS = 100_000
"""Rows of a row group in the finished file."""
META = "tactful"


class Recorder:
    """Write a feed to a file, in a thread of its own.

    While it records, the file is a stream of Arrow record batches, which can be read up to the last one whatever ends
    the process. When it is closed, the file becomes Parquet. The readers of recordings know both by their content,
    under the one name. Channels have their canonical names; settings and events are in the metadata.

    Args:
        path: the file, ending in `.parquet`; it must not be there yet.

    Raises:
        TactfulError: if the file cannot be made, or pyarrow is not installed.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._about: dict[str, Any] = {}
        self.missed = 0
        self.problem: str | None = None
        if path.suffix != ".parquet":
            raise TactfulError(f"{path}: recordings are written as .parquet, not {path.suffix or 'without a suffix'}")
        try:
            import pyarrow
        except ImportError:
            raise TactfulError('recording needs pyarrow: pip install "tactful[files]"') from None
        self._pa = pyarrow
        try:
            self._file: BinaryIO = path.open("xb", buffering=0)
        except FileExistsError:
            raise TactfulError(f"{path}: is there already: name another file, or move it away") from None
        except OSError as error:
            raise TactfulError(f"{path}: cannot be written: {error.strerror or error}") from None
        self._done = threading.Event()
        self._thread: threading.Thread | None = None
        self._writer: Any = None
        self._events: list[dict[str, Any]] = []

    def follow(self, feed: Feed, about: dict[str, Any]) -> None:
        """Begin to write what a feed brings; `about` goes into the metadata."""
        self._about = {"units": "SI", **about}
        self._thread = threading.Thread(target=self._follow, args=(feed,), name="tactful-recorder", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Write what is left, and turn the stream into Parquet; a file without any sample is removed.

        What went wrong is in `problem`; the stream is kept then.
        """
        self._done.set()
        if self._thread is not None:
            self._thread.join()
        if self._file.closed:
            return
        if self._writer is not None:
            self._attempt(self._writer.close)
        self._file.close()
        if self._writer is None:
            self.path.unlink(missing_ok=True)
        elif self.problem is None:
            self._attempt(self._finish)

    def _follow(self, feed: Feed) -> None:
        subscription = feed.subscribe()
        names = [("time", "t", 0)]
        names += [(f"{name}_{i}", name, i) for name, width in feed.widths.items() for i in range(width)]
        fields = [(column, self._pa.float64()) for column, _, _ in names]
        schema = self._pa.schema(fields, metadata={META: json.dumps(self._about)})
        self._attempt(lambda: self._begin(schema))
        last = False
        while self.problem is None:
            batch = subscription.read()
            self.missed += batch.missed
            if len(batch.t) or batch.events:
                self._attempt(lambda batch=batch: self._write(batch, names, schema))
            if last:
                return
            last = self._done.wait(_FLUSH_S)

    def _begin(self, schema: Any) -> None:
        self._writer = self._pa.ipc.new_stream(self._file, schema)

    def _write(self, batch: Batch, names: list[tuple[str, str, int]], schema: Any) -> None:
        columns = [batch.t if name == "t" else batch.channels[name][:, i].copy() for _, name, i in names]
        told = [{"told_s": t, **event.to_dict()} for t, event in batch.events]
        self._events += told
        rows = self._pa.record_batch([self._pa.array(column) for column in columns], schema=schema)
        self._writer.write_batch(rows, custom_metadata={META: json.dumps({"events": told})} if told else None)

    def _finish(self) -> None:
        """Turn the stream into Parquet, beside it first."""
        import pyarrow.parquet as pq

        part = self.path.with_name(f".{self.path.name}.part")
        try:
            with self.path.open("rb") as file, self._pa.ipc.open_stream(file) as stream:
                about = json.dumps({**self._about, "events": self._events})
                schema = stream.schema.with_metadata({META: about})
                with pq.ParquetWriter(part, schema, write_page_checksum=True, use_dictionary=False) as writer:
                    for rows in stream:
                        writer.write_batch(rows.replace_schema_metadata({META: about}), row_group_size=_ROWS)
            os.replace(part, self.path)
        finally:
            part.unlink(missing_ok=True)

    def _attempt(self, write: Any) -> None:
        """Do what may fail, and keep the reason: a full disk must not stop an arm."""
        try:
            write()
        except (OSError, self._pa.ArrowException) as error:
            self.problem = f"{self.path}: recording stopped: {' '.join(str(error).split())}"


def read_log(path: str | Path) -> dict[str, Any]:
    """Return what a recording of a live run says beside its samples: `config`, `robot`, `source` and `events`.

    Raises:
        RecordingError: if the file cannot be read.
        TactfulError: if it is no recording of a live run.
    """
    from tactful.recordings._read import _open

    meta = _open(Path(path)).meta
    if not isinstance(meta, dict) or "events" not in meta:
        raise TactfulError(f"{path}: is no recording of a live run: it holds no events")
    return meta
