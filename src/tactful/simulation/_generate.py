"""Data sets of episodes."""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass
from multiprocessing import get_context
from pathlib import Path
from typing import Any

from tactful.errors import TactfulError
from tactful.simulation._peg import PEG
from tactful.simulation._simulate import run_episode
from tactful.simulation._spec import EpisodeSpec

MANIFEST = "manifest.jsonl"
MONITOR = "monitor.toml"
"""Settings that tell a monitor the arm of the recordings, written beside them."""


@dataclass(frozen=True)
class EpisodeEntry:
    """One line of a manifest.

    Attributes:
        file: name of the recording.
        spec: what it was made from.
        contacts: the true contacts, weak touches too, as plain numbers.
        duration_s: its length [s].
        inserted: whether the peg was in the hole at the end.
    """

    file: str
    spec: EpisodeSpec
    contacts: tuple[dict[str, Any], ...]
    duration_s: float
    inserted: bool

    def to_dict(self) -> dict[str, Any]:
        """Return plain data."""
        spec = self.spec.model_dump(mode="json")
        contacts = list(self.contacts)
        return {**vars(self), "spec": spec, "contacts": contacts}


def generate(
    specs: Iterable[EpisodeSpec],
    out: str | Path,
    *,
    jobs: int = 2,
    scheduler: Any = None,
    on_done: Callable[[EpisodeEntry], None] | None = None,
) -> list[EpisodeEntry]:
    """Simulate episodes and write each to a Parquet file of a folder, with a manifest and the settings of a monitor.

    What is complete is not made again, so an interrupted call can be repeated. A recording appears whole or not at
    all; a line of the manifest follows it. `tactful evaluate OUT --config OUT/monitor.toml` reads the result.

    Args:
        specs: the episodes; the same spec twice is made once.
        out: the folder, made if it is not there.
        jobs: number of processes, where no scheduler is given.
        scheduler: a `dask.distributed.Client`, or anything with its `submit`, to simulate elsewhere; its workers have
            to see the folder.
        on_done: is told every episode that is complete, those that were complete before first.

    Returns:
        An entry for each spec, in their order.

    Raises:
        TactfulError: if there is no spec, `jobs` is below 1, the folder cannot be written, or an episode is impossible.
    """
    wanted = list({spec.name: spec for spec in specs}.values())
    if not wanted:
        raise TactfulError("no episode was asked for: give at least one spec")
    if jobs < 1:
        raise TactfulError(f"jobs is {jobs}: it has to be at least 1")
    folder = Path(out).absolute()
    try:
        folder.mkdir(parents=True, exist_ok=True)
        arm = {"model": PEG.model, "payload_kg": PEG.payload_kg, "payload_com_m": list(PEG.payload_com_m)}
        lines = "".join(f"{key} = {json.dumps(value)}\n" for key, value in arm.items())
        (folder / MONITOR).write_text(f"[robot]\n{lines}", encoding="utf-8")
    except OSError as error:
        raise TactfulError(f"{folder}: cannot be written: {error.strerror}") from None
    done = {entry.spec.name: entry for entry in read_manifest(folder)} if (folder / MANIFEST).is_file() else {}
    others = {name: entry for name, entry in done.items() if (folder / entry.file).is_file()}
    ready = {spec.name: others[spec.name] for spec in wanted if spec.name in others}
    for entry in ready.values():
        if on_done:
            on_done(entry)
    missing = [spec for spec in wanted if spec.name not in ready]
    _write_manifest(folder, others.values())
    with (folder / MANIFEST).open("a", encoding="utf-8") as manifest:
        for entry in _made(missing, folder, jobs, scheduler):
            manifest.write(json.dumps(entry.to_dict()) + "\n")
            manifest.flush()
            ready[entry.spec.name] = others[entry.spec.name] = entry
            if on_done:
                on_done(entry)
    _write_manifest(folder, others.values())
    return [ready[spec.name] for spec in wanted]


def read_manifest(folder: str | Path) -> list[EpisodeEntry]:
    """Return what a folder of episodes holds; a last line that was not written to its end is left out.

    Raises:
        TactfulError: if the folder has no manifest, or another line cannot be read.
    """
    path = Path(folder) / MANIFEST
    try:
        lines = path.read_text(encoding="utf-8").splitlines(keepends=True)
    except OSError as error:
        raise TactfulError(f"{path}: cannot be read: {error.strerror}") from None
    entries = []
    for number, line in enumerate(lines, 1):
        try:
            data = json.loads(line)
            data |= {"spec": EpisodeSpec(**data["spec"]), "contacts": tuple(data["contacts"])}
            entries.append(EpisodeEntry(**data))
        except (ValueError, TypeError, KeyError) as error:
            if number == len(lines) and not line.endswith("\n"):
                break
            raise TactfulError(f"{path}, line {number}: is not an episode ({error}); remove the line") from None
    return entries


def _write_manifest(folder: Path, entries: Iterable[EpisodeEntry]) -> None:
    lines = [json.dumps(entry.to_dict()) + "\n" for entry in sorted(entries, key=lambda entry: entry.file)]
    part = folder / f".{MANIFEST}"
    part.write_text("".join(lines), encoding="utf-8")
    os.replace(part, folder / MANIFEST)


def _made(specs: list[EpisodeSpec], folder: Path, jobs: int, scheduler: Any) -> Iterator[EpisodeEntry]:
    """Yield the episodes as they become complete."""
    if scheduler is not None:
        from distributed import as_completed as as_gathered

        futures = [scheduler.submit(_make, spec, folder, pure=False) for spec in specs]
        yield from (future.result() for future in as_gathered(futures))  # type: ignore[no-untyped-call]
    elif jobs == 1:
        yield from (_make(spec, folder) for spec in specs)
    elif specs:
        with ProcessPoolExecutor(min(jobs, len(specs)), mp_context=get_context("spawn")) as pool:
            waiting = [pool.submit(_make, spec, folder) for spec in specs]
            try:
                yield from (future.result() for future in as_completed(waiting))
            finally:
                pool.shutdown(cancel_futures=True)


def _make(spec: EpisodeSpec, folder: Path) -> EpisodeEntry:
    result = run_episode(spec)
    file = f"{spec.name}.parquet"
    for torn in folder.glob(f".{file}.*"):  # of a process that was killed
        torn.unlink(missing_ok=True)
    result.recording.save(folder / file)
    contacts = tuple(contact.to_dict() for contact in result.contacts)
    return EpisodeEntry(file, spec, contacts, result.recording.duration_s, result.inserted)
