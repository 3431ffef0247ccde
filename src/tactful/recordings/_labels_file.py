"""Labels beside a recording: `<name>.labels.json`, or `labels.json` for a whole folder."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from tactful.recordings._errors import RecordingError
from tactful.recordings._label import Label
from tactful.recordings._recording import Recording
from tactful.recordings._table import Table


def sidecar(path: Path) -> Path:
    """Where the labels of one file stand."""
    return path.with_name(path.name + ".labels.json")


def to_json(recording: Recording) -> str:
    """Labels and notes, as they are stored with the channels."""
    return json.dumps({"labels": [label.to_dict() for label in recording.labels], "notes": list(recording.notes)})


def find(table: Table) -> tuple[list[Label], list[str]]:
    """Labels and notes in the file's own metadata, in its sidecar, and in the `labels.json` of its folder."""
    labels: list[Label] = []
    notes: list[str] = []
    stores: list[tuple[Path, Any]] = [] if table.meta is None else [(table.path, table.meta)]
    if (path := sidecar(table.path)).is_file():
        stores.append((path, _load(path)))
    if (path := table.path.with_name("labels.json")).is_file():
        folder = _load(path)
        if not isinstance(folder, Mapping):
            raise RecordingError('expected an object with file names as keys: {"run.csv": [...]}', path=path)
        if table.path.name in folder:
            stores.append((path, folder[table.path.name]))
    for path, store in stores:
        entries, said = (store.get("labels", []), store.get("notes", [])) if isinstance(store, Mapping) else (store, [])
        if not isinstance(entries, list) or not isinstance(said, list):
            raise RecordingError("labels are a list of objects with kind, start_s and end_s", path=path)
        try:
            labels += [Label.from_dict(entry) for entry in entries]
        except RecordingError as error:
            raise RecordingError(str(error), path=path) from None
        notes += map(str, said)
    return labels, notes


def _load(path: Path) -> Any:
    try:
        return json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError) as error:
        raise RecordingError(f"the labels cannot be read: {error}", path=path) from None
