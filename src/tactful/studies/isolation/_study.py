"""The study as a whole: trials, summary, tables and pictures in a folder."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

from tactful.robots import Robot
from tactful.studies.isolation._figures import pictures
from tactful.studies.isolation._run import run
from tactful.studies.isolation._summary import Figures, summarise
from tactful.studies.isolation._tables import tables


def isolation_study(
    robot: Robot,
    out: Path,
    *,
    samples: int = 4000,
    seed: int = 0,
    jobs: int = 1,
    progress: Callable[[float], None] = lambda share: None,
) -> Figures:
    """Measure isolation and identification on simulated contacts; the result depends on the seed alone.

    Writes `summary.json`, `tables.md`, `links.svg`, `calibration.svg` and `motion.svg` into `out`.

    Args:
        robot: the arm; it needs capsules.
        out: folder, made if it is missing.
        samples: contacts for the tables of links; other tables take a fraction of it.
        seed: what everything is drawn from.
        jobs: number of processes.
        progress: is told the share of the trials that is done.

    Returns:
        What is in `summary.json`.

    Raises:
        RobotError: if the surface of the arm is not known.
        TactfulError: if a number is out of range, or matplotlib is missing.
    """
    summary = summarise(robot, run(robot, samples, seed, jobs, progress), samples, seed)
    out.mkdir(parents=True, exist_ok=True)
    (out / "summary.json").write_text(json.dumps(summary, indent=1, allow_nan=False) + "\n", encoding="utf-8")
    (out / "tables.md").write_text(tables(summary), encoding="utf-8")
    pictures(summary, out)
    return summary
