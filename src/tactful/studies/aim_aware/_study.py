"""The study as a whole: sweep, bands, robustness, pictures and report in a folder."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np

from tactful.simulation.planar import PlanarConfig
from tactful.studies._parallel import connected
from tactful.studies.aim_aware._figures import pictures
from tactful.studies.aim_aware._store import earlier, write
from tactful.studies.aim_aware._summary import Figures, summarise
from tactful.studies.aim_aware._variants import Grid


def aim_aware_study(
    out: Path,
    *,
    grid: Grid = "paper",
    planar: PlanarConfig | None = None,
    seed: int = 0,
    jobs: int = 1,
    scheduler: str | None = None,
    progress: Callable[[float], None] = lambda share: None,
) -> Figures:
    """Run the simulated sweep of the aim-aware paper, tune the classifier, and measure both on held-out impacts.

    Writes into `out`: `summary.json`, `tables.md`, `report.html` with all of it, `fig6.svg`, `fig7.svg`, and
    `evidence.npz`: for every impact of the grid and held out, and every set of settings, the least e_m, epsilon, zeta,
    iota and tilt that accept it. The paper gives neither robot nor controller nor r_b: what comes out shows that its
    figures can be reached, with an assumed arm.

    Source: B. Proper et al. 2023, https://hal.science/hal-03974694v3, Sec. IV-A.

    Args:
        out: folder, made if it is missing.
        grid: inclinations every 1 deg, as in the paper, or every 0.25 deg.
        planar: arm, task, contact, controller and sensors.
        seed: of the noise of the sensors, where there is some, and of the tuning.
        jobs: number of processes.
        scheduler: address of a Dask scheduler to work there.
        progress: is told the share that is done.

    Returns:
        What is in `summary.json`.

    Raises:
        TactfulError: if a number is out of range, the scheduler does not answer, or matplotlib or optuna is missing.
    """
    config = planar or PlanarConfig()
    out.mkdir(parents=True, exist_ok=True)
    beside = {name: block for name, block in earlier(out).items() if name == "panda"}
    with connected(scheduler) as client:
        summary, evidence = summarise(grid, config, seed, jobs, client, progress)
    summary |= beside
    np.savez_compressed(out / "evidence.npz", allow_pickle=False, **evidence)
    pictures(summary, config, out)
    write(out, summary)
    return summary
