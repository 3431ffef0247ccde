"""The study: trials in chunks of their own seeds, so that neither order nor the number of processes matters."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass
from multiprocessing import get_context

import numpy as np
from numpy.typing import NDArray

from tactful.errors import TactfulError
from tactful.robots import Robot
from tactful.studies.isolation import _motion, _trials

Array = NDArray[np.float64]
Columns = dict[str, Array]
Results = dict[tuple[str, str], Columns]
"""Columns of numbers by the kind of trial and what varies within it."""

_CHUNK = {"motion": 20, "singular": 100}
_DEFAULT_CHUNK = 100


@dataclass(frozen=True)
class _Chunk:
    kind: str
    case: str
    count: int
    seed: tuple[int, ...]


def run(
    robot: Robot, samples: int, seed: int, jobs: int, progress: Callable[[float], None] = lambda share: None
) -> Results:
    """Run all trials.

    Args:
        robot: the arm.
        samples: how many contacts for the tables of links; other tables take a fraction of it.
        seed: what everything is drawn from.
        jobs: number of processes.
        progress: is told the share that is done.

    Raises:
        TactfulError: if a number is out of range.
    """
    for name, value, least in (("samples", samples, 20), ("jobs", jobs, 1), ("seed", seed, 0)):
        if value < least:
            raise TactfulError(f"{name} is {value}: it has to be at least {least}")
    chunks = list(_plan(robot, samples, seed))
    total, done = sum(chunk.count for chunk in chunks), 0
    rows: dict[int, list[_trials.Row]] = {}
    if jobs == 1:
        for index, chunk in enumerate(chunks):
            rows[index] = _work(robot, chunk)
            done += chunk.count
            progress(done / total)
    else:
        with ProcessPoolExecutor(jobs, mp_context=get_context("spawn")) as pool:
            waiting = {pool.submit(_work, robot, chunk): index for index, chunk in enumerate(chunks)}
            for future in as_completed(waiting):
                rows[waiting[future]] = future.result()
                done += chunks[waiting[future]].count
                progress(done / total)
    gathered: dict[tuple[str, str], list[_trials.Row]] = {}
    for index, chunk in enumerate(chunks):
        gathered.setdefault((chunk.kind, chunk.case), []).extend(rows[index])
    return {key: {name: np.array([row[name] for row in of]) for name in of[0]} for key, of in gathered.items()}


def _plan(robot: Robot, samples: int, seed: int) -> Iterator[_Chunk]:
    links = sorted({capsule.link for capsule in robot.capsules if 0 <= capsule.link < robot.frames[robot.tip].link})
    kinds = [
        ("links", [""], samples),
        ("departures", list(_trials.DEPARTURES), samples // 2),
        ("known", [str(link) for link in links], samples // 5),
        ("pairs", [_trials.AT_TIP, _trials.ON_ANY], samples // 2),
        ("singular", ["1", "50"], samples // 4),
        ("motion", [""], samples // 8),
    ]
    for number, (kind, cases, count) in enumerate(kinds):
        size = _CHUNK.get(kind, _DEFAULT_CHUNK)
        for i, case in enumerate(cases):
            for part in range(math.ceil(count / size)):
                yield _Chunk(kind, case, min(size, count - part * size), (seed, number, i, part))


def _work(robot: Robot, chunk: _Chunk) -> list[_trials.Row]:
    lab = _trials.Laboratory(robot, np.random.default_rng(chunk.seed))
    trial = _motion.motion if chunk.kind == "motion" else _trials.TRIALS[chunk.kind]
    return [row for _ in range(chunk.count) for row in trial(lab, chunk.case)]
