"""The recordings of a data set."""

from __future__ import annotations

import json
from collections.abc import Iterable
from difflib import get_close_matches
from pathlib import Path

from tactful.evaluation._errors import EvaluationError

_SUFFIXES = (".bag", ".csv", ".csv.gz", ".db3", ".json", ".mcap", ".npz", ".parquet", ".tsv")
_LABELS, _SIDECAR = "labels.json", ".labels.json"


def find_recordings(paths: Iterable[str | Path]) -> tuple[Path, ...]:
    """Return the files that are named, and those in the folders that are named, and in theirs, by name.

    In a folder, recordings are told by their suffix: .csv, .csv.gz, .tsv, .parquet, .npz, .json, .mcap, .db3 or .bag.
    Hidden files are left out.

    Raises:
        EvaluationError: a folder is not there or holds no recording, or its labels are of one that is not there.
    """
    files: list[Path] = []
    for path in map(Path, paths):
        if not path.is_dir():
            files.append(path)
            continue
        inside = sorted(
            file
            for file in path.rglob("*")
            if file.is_file() and not any(part.startswith(".") for part in file.relative_to(path).parts)
        )
        for file in inside:
            if file.name.endswith(_LABELS):
                _check_names(file)
        found = [file for file in inside if file.name.endswith(_SUFFIXES) and not file.name.endswith(_LABELS)]
        if not found:
            raise EvaluationError(f"holds no recording: they end in {', '.join(_SUFFIXES)}", source=str(path))
        files += found
    return tuple(dict.fromkeys(files))


def _check_names(labels: Path) -> None:
    """Refuse labels of recordings that are not there."""
    if labels.name == _LABELS:
        try:
            names = list(json.loads(labels.read_text(encoding="utf-8")))
        except (OSError, ValueError, TypeError, RecursionError):
            return  # told when the first recording of the folder is read
    elif labels.name.endswith(_SIDECAR):
        names = [labels.name.removesuffix(_SIDECAR)]
    else:
        return
    there = [file.name for file in labels.parent.iterdir()]
    for name in map(str, names):
        if name not in there:
            near = get_close_matches(name, [file for file in there if file.endswith(_SUFFIXES)], n=1)
            hint = f"did you mean {near[0]!r}?" if near else "name a file of this folder, or remove the labels"
            raise EvaluationError(f"labels a recording that is not there, {name!r}: {hint}", source=str(labels))
