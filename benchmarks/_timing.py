"""How times are taken."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping


def shortest_s(jobs: Mapping[str, Callable[[], Callable[[], object]]], rounds: int) -> dict[str, float]:
    """Return the shortest time of each job [s].

    The jobs take turns (A B C A B C ...), so whatever else the machine does meets all of them alike; each lasts a few
    milliseconds, so some turns meet nothing, and the shortest is the time of the job itself. A job is given as a
    function that prepares it, which is not timed.
    """
    shortest = dict.fromkeys(jobs, float("inf"))
    for _ in range(rounds):
        for name, prepare in jobs.items():
            job = prepare()
            begin = time.perf_counter()
            job()
            shortest[name] = min(shortest[name], time.perf_counter() - begin)
    return shortest
