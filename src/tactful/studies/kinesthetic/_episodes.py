"""The episodes of the study on disk: made once, and found again by the next call."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from tactful.errors import TactfulError
from tactful.simulation import EpisodeEntry, EpisodeSpec, generate


def make_episodes(
    sets: Mapping[str, Sequence[EpisodeSpec]],
    folder: Path,
    *,
    jobs: int,
    client: Any = None,
    progress: Callable[[float], None] = lambda share: None,
) -> tuple[dict[str, list[EpisodeEntry]], int]:
    """Simulate what is not in the folder yet.

    Args:
        sets: the specs by the name of their set.
        folder: where the recordings are kept, all in one.
        jobs: number of processes.
        client: of a Dask cluster, to simulate there.
        progress: is told the share that is done.

    Returns:
        The entries of each set in the order of its specs, and how many of the specs are impossible: no attempt gave
        the contacts that their kind names. Those are left out.

    Raises:
        TactfulError: if the folder cannot be written.
    """
    wanted = {spec.name: spec for specs in sets.values() for spec in specs}
    total, impossible = len(wanted), 0
    while True:
        done: dict[str, EpisodeEntry] = {}

        def note(entry: EpisodeEntry, done: dict[str, EpisodeEntry] = done, left: int = len(wanted)) -> None:
            done[entry.spec.name] = entry
            progress((total - left + len(done)) / total)

        try:
            generate(wanted.values(), folder, jobs=jobs, scheduler=client, on_done=note)
        except TactfulError as error:
            name = _impossible(str(error), wanted)
            if name is None:
                raise
            del wanted[name]
            impossible += 1
            continue
        return {key: [done[s.name] for s in specs if s.name in done] for key, specs in sets.items()}, impossible


def _impossible(message: str, wanted: Mapping[str, EpisodeSpec]) -> str | None:
    """Return the episode of which a message says that no attempt gave it."""
    named = (name for name in wanted if message.startswith(f"episode {name}:"))
    return next(named, None)
