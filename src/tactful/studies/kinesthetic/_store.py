"""What the monitors said, kept on disk a line an episode, so that an interrupted study goes on."""

from __future__ import annotations

import functools
import hashlib
import json
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import tactful
from tactful.monitor import MonitorConfig
from tactful.studies._parallel import results
from tactful.studies.kinesthetic._watch import Row, Watch


@dataclass(frozen=True)
class Store:
    """Rows of the study, in one file a monitor, `NAME.jsonl`.

    Attributes:
        folder: where they are.
        jobs: number of processes.
        client: of a Dask cluster, or None.
        progress: is told that another episode is done.
    """

    folder: Path
    jobs: int
    client: Any
    progress: Callable[[], None]

    def rows(self, name: str, work: Callable[[Watch], Row], tasks: Sequence[Watch]) -> list[Row]:
        """Return what a monitor says of each task, in their order; what is on disk is not made again."""
        self.folder.mkdir(parents=True, exist_ok=True)
        file = self.folder / f"{re.sub('[^A-Za-z0-9.]+', '-', name)}.jsonl"
        known = self._known(file)
        keys = [_key(task) for task in tasks]
        missing = {key: task for key, task in zip(keys, tasks, strict=True) if key not in known}
        for _ in range(len(tasks) - len(missing)):
            self.progress()
        with file.open("a", encoding="utf-8") as lines:
            order = list(missing)
            for number, row in results(work, list(missing.values()), jobs=self.jobs, client=self.client):
                known[order[number]] = row
                lines.write(json.dumps({"key": order[number], "row": row}) + "\n")
                lines.flush()
                self.progress()
        return [known[key] for key in keys]

    def _known(self, file: Path) -> dict[str, Row]:
        """Return the rows of a file; a line that was not written to its end is cut off."""
        if not file.is_file():
            return {}
        known: dict[str, Row] = {}
        text = file.read_text(encoding="utf-8")
        whole = text[: text.rfind("\n") + 1]
        if whole != text:
            file.write_text(whole, encoding="utf-8")
        for line in whole.splitlines():
            data = json.loads(line)
            known[data["key"]] = data["row"]
        return known


@functools.cache
def code() -> str:
    """Return a digest of the code that monitors, calibrates and trains: what other code said does not count."""
    package = Path(tactful.__file__).parent
    digest = hashlib.sha256()
    for file in sorted(package.rglob("*.py")):
        part = file.relative_to(package).parts[0]
        if part not in ("cli", "live", "studies") or file.name in ("_watch.py", "_onsets.py"):
            digest.update(file.read_bytes())
    return digest.hexdigest()


def _key(task: Watch) -> str:
    """Return a name of all that the row depends on."""
    digest = hashlib.sha256(f"{code()} {task.located} {task.turned} {task.file.name}".encode())
    digest.update(_settings(task.config))
    return digest.hexdigest()[:20]


def _settings(config: MonitorConfig) -> bytes:
    plain = config.model_dump_json(exclude={"provenance", "classifier"}).encode()
    path = Path(config.classifier)
    return plain + (path.read_bytes() if path.is_file() else config.classifier.encode())
