"""Labels beside a recording: `<name>.labels.json`, or `labels.json` for a whole folder."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
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
    """Labels and notes, as they are stored with the channels; `units` says that no unit has to be judged."""
    labels = [label.to_dict() for label in recording.labels]
    return json.dumps({"units": "SI", "labels": labels, "notes": list(recording.notes)})


@dataclass
class Beside:
    """What stands beside the channels of a file; `si` where Tactful wrote it, so that its units are known."""

    labels: list[Label] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    si: bool = False


def find(table: Table) -> Beside:
    """Labels and notes in the file's own metadata, in its sidecar, and in the `labels.json` of its folder."""
    beside = Beside()
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
        data: Mapping[str, Any] = store if isinstance(store, Mapping) else {"labels": store}
        entries, said = data.get("labels", []), data.get("notes", [])
        if not isinstance(entries, list) or not isinstance(said, list):
            raise RecordingError("labels are a list of objects with kind, start_s and end_s", path=path)
        try:
            beside.labels += [Label.from_dict(entry) for entry in entries]
        except RecordingError as error:
            raise RecordingError(str(error), path=path) from None
        beside.notes += map(str, said)
        beside.si |= data.get("units") == "SI"
    return beside


def _load(path: Path) -> Any:
    try:
        return json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError) as error:
        raise RecordingError(f"the labels cannot be read: {error}", path=path) from None
