"""From a recording to a file, all at once or not at all."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from tactful.recordings import _labels_file, formats
from tactful.recordings._errors import RecordingError
from tactful.recordings._units import units_would_be_judged

if TYPE_CHECKING:
    from tactful.recordings._recording import Recording


def save(recording: Recording, path: str | Path) -> None:
    """See `Recording.save`."""
    path = Path(path)
    writers = {module.SUFFIX: module.save for module in formats.modules() if hasattr(module, "SUFFIX")}
    if path.suffix not in writers:
        raise RecordingError(
            f"cannot write {path.suffix or 'a file without suffix'}: use {', '.join(sorted(writers))}", path=path
        )
    try:
        _replace(path, lambda part: writers[path.suffix](recording, part))
        if path.suffix == ".csv":
            beside = _labels_file.sidecar(path)
            if recording.labels or recording.notes or units_would_be_judged(recording.t, recording.channels):
                text = _labels_file.to_json(recording)
                _replace(beside, lambda part: part.write_text(text + "\n", encoding="utf-8"))
            else:
                beside.unlink(missing_ok=True)
    except OSError as error:
        raise RecordingError(f"cannot be written: {error.strerror or error}", path=path) from None


def _replace(path: Path, write: Callable[[Path], object]) -> None:
    handle, name = tempfile.mkstemp(prefix=f".{path.name}.", suffix=path.suffix, dir=path.parent)
    os.close(handle)
    part = Path(name)
    try:
        write(part)
        mask = os.umask(0)
        os.umask(mask)
        part.chmod(0o666 & ~mask)
        os.replace(part, path)
    finally:
        part.unlink(missing_ok=True)
