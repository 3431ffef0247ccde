"""The study as a whole: sweep, bands, robustness and pictures in a folder."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

from tactful.simulation.planar import PlanarConfig
from tactful.studies.aim_aware._figures import pictures
from tactful.studies.aim_aware._summary import Figures, Grid, summarise
from tactful.studies.aim_aware._tables import tables


def aim_aware_study(
    out: Path,
    *,
    grid: Grid = "paper",
    planar: PlanarConfig | None = None,
    seed: int = 0,
    jobs: int = 1,
    progress: Callable[[float], None] = lambda share: None,
) -> Figures:
    """Run the simulated sweep of the aim-aware paper, tune the classifier, and measure both on held-out impacts.

    Writes `summary.json`, `tables.md`, `fig6.svg` and `fig7.svg` into `out`. The paper gives neither robot nor
    controller nor r_b: what comes out shows that its figures can be reached, with an assumed arm.

    Source: B. Proper et al. 2023, https://hal.science/hal-03974694v3, Sec. IV-A.

    Args:
        out: folder, made if it is missing.
        grid: inclinations every 1 deg, as in the paper, or every 0.25 deg.
        planar: arm, task, contact, controller and sensors.
        seed: of the noise of the sensors, where there is some.
        jobs: number of processes.
        progress: is told the share that is done.

    Returns:
        What is in `summary.json`.

    Raises:
        TactfulError: if a number is out of range, or matplotlib is missing.
    """
    config = planar or PlanarConfig()
    summary = summarise(grid, config, seed, jobs, progress)
    out.mkdir(parents=True, exist_ok=True)
    (out / "summary.json").write_text(json.dumps(summary, indent=1, allow_nan=False) + "\n", encoding="utf-8")
    (out / "tables.md").write_text(tables(summary), encoding="utf-8")
    pictures(summary, config, out)
    return summary
