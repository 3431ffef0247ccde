"""How fast Tactful is, against stated bounds and against the same chain written with its peers."""

from __future__ import annotations

import json
import os
import platform
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from rich.console import Console

ROBOT = "panda"


@dataclass(frozen=True, slots=True)
class Sizes:
    """How much is measured."""

    rounds: int = 300
    """Turns of the chain and its peers."""
    loop_s: float = 20.0
    hour_s: float = 3600.0
    repeats: int = 4
    """Processes of which the fastest counts."""
    episodes: int = 20
    """Simulated episodes."""
    first_call: bool = True
    """Whether the kernels are compiled anew to time it."""


def run(sizes: Sizes, file: Path, console: Console) -> dict[str, Any]:
    """Measure all, print the tables, write the numbers to a JSON file and return them.

    Raises:
        TactfulError: if a peer does not find what the monitor finds.
    """
    from benchmarks._chain import measure_chain
    from benchmarks._episodes import measure_episodes
    from benchmarks._hour import measure_hour
    from benchmarks._locate import measure_locate
    from benchmarks._loop import measure_loop
    from benchmarks._report import report
    from benchmarks._start import measure_start
    from tactful import Robot

    file.parent.mkdir(parents=True, exist_ok=True)
    robot = Robot.load(ROBOT)
    result: dict[str, Any] = {"machine": _machine()}
    with console.status("imports and the command line"):
        result |= measure_start(ROBOT, sizes.repeats, first_call=sizes.first_call)
    with console.status("the chain and its peers"):
        result |= measure_chain(robot, sizes.rounds)
    with console.status("the location of contacts"):
        result |= measure_locate(robot)
    with console.status("an hour at 1 kHz"):
        result |= measure_hour(ROBOT, sizes.hour_s, sizes.repeats, file.parent)
    with console.status("the loop at 1 kHz"):
        result["loop_us"] = measure_loop(robot, sizes.loop_s)
    with console.status("episodes of the work cell"):
        result |= measure_episodes(sizes.episodes)
    file.write_text(json.dumps(result, indent=2) + "\n", encoding="utf-8")
    report(result, console)
    console.print(f"\n[dim]{file}", highlight=False)
    return result


def _machine() -> dict[str, Any]:
    packages: dict[str, str | None] = {}
    for name in ("numpy", "numba", "pin", "mujoco", "pyarrow"):
        try:
            packages[name] = version(name)
        except PackageNotFoundError:
            packages[name] = None
    return {
        "platform": platform.platform(),
        "cores": os.cpu_count(),
        "python": platform.python_version(),
        "packages": packages,
        "load": os.getloadavg()[0] if hasattr(os, "getloadavg") else None,
    }
