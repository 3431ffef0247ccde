"""From a path to a recording."""

from __future__ import annotations

from collections.abc import Mapping
from difflib import get_close_matches
from pathlib import Path
from typing import Any

import numpy as np

from tactful.recordings import _canonical, formats
from tactful.recordings._errors import RecordingError
from tactful.recordings._plan import labels_from, note_unused
from tactful.recordings._recording import Recording
from tactful.recordings._table import DECODING_ERRORS, Table, damaged
from tactful.recordings._units import judge_positions, judge_time


def read(path: str | Path, mapping: str | Path | Mapping[str, Any] | None = None) -> Recording:
    """See `Recording.read`."""
    return _build(_open(Path(path)), mapping)


def _open(path: Path) -> Table:
    try:
        with path.open("rb") as file:
            head = file.read(4096)
    except FileNotFoundError:
        raise RecordingError(f"there is no such file{_nearest(path)}", path=path) from None
    except IsADirectoryError:
        raise RecordingError("this is a directory: name a file in it", path=path) from None
    except (OSError, ValueError) as error:
        raise RecordingError(f"cannot be read: {error}", path=path) from None
    if not head:
        raise RecordingError("the file is empty", path=path)
    module = next(module for module in formats.modules() if module.matches(head))
    try:
        table: Table = module.open_table(path)
    except DECODING_ERRORS as error:
        raise damaged(path, error) from error
    return table


def _build(table: Table, mapping: str | Path | Mapping[str, Any] | None) -> Recording:
    from tactful.recordings import _labels_file, _layout

    layout = _layout.find(table) if mapping is None else _layout.load(mapping)
    plan = _canonical.plan(table) if layout is None else layout.plan(table)
    notes = [*table.notes, *plan.notes]
    t = table.column(plan.time).reshape(-1)
    if len(t) != table.rows:
        raise RecordingError(f"time column {plan.time!r} holds several values a row", path=table.path, column=plan.time)
    channels = {name: plan.values(table, name) for name in plan.channels}
    beside = _labels_file.find(table)
    factor = 1.0 if beside.si else plan.time_factor
    if factor is None:
        factor, reason = judge_time(t, channels.get("q"), channels.get("dq"))
        notes += reason
    if factor != 1.0:
        t = t * factor
    if not plan.explicit and not beside.si:
        notes += judge_positions(t, channels)
    if plan.relative and np.isfinite(t).any():
        start = float(t[np.isfinite(t)][0])
        t = t - start
        notes.append(f"time starts at 0 in the first row, which is stamped {start:.6f} s")
    labels = beside.labels
    for source in plan.labels:
        labels += labels_from(table, source, t)
    return Recording(
        t=t,
        channels=channels,
        labels=tuple(labels),
        source=str(table.path),
        format=f"{table.format}/{plan.name}" if plan.name else table.format,
        notes=tuple(dict.fromkeys([*notes, *note_unused(plan.unused(table)), *beside.notes])),
    )


def _nearest(path: Path) -> str:
    try:
        names = [entry.name for entry in path.parent.iterdir()]
    except OSError:
        return f", nor a directory {path.parent}"
    near = get_close_matches(path.name, names, n=1, cutoff=0.5)
    return f": did you mean {near[0]!r}?" if near else ""
