"""The experiment with an arm on the bench: runs, bands, pictures and report in a folder."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np

from tactful.simulation.impact_bench import BenchConfig
from tactful.studies._parallel import connected
from tactful.studies.aim_aware._panda_figures import bench_pictures
from tactful.studies.aim_aware._panda_summary import Figures, summarise_bench
from tactful.studies.aim_aware._store import earlier, write


def panda_study(
    out: Path,
    *,
    bench: BenchConfig | None = None,
    seed: int = 0,
    jobs: int = 1,
    scheduler: str | None = None,
    progress: Callable[[float], None] = lambda share: None,
) -> Figures:
    """Repeat the experiment of the aim-aware paper with a simulated arm, and judge it by Tab. 2 and by tuned sets.

    A Panda with elastic joints, the noise of a real one and a flat tool strikes a platform that is inclined, in MuJoCo;
    the post-impact reference comes from recorded nominal runs, as in the paper, and from the impact map. Writes into
    `out`: the block `panda` of `summary.json`, `fig8.svg`, `fig6b.svg`, `evidence_panda.npz`, and `tables.md` and
    `report.html` with all of it. What a planar study wrote into the folder before stays.

    Source: B. Proper et al. 2023, https://hal.science/hal-03974694v3, Sec. IV-B.

    Args:
        out: folder, made if it is missing.
        bench: arm, tool, task, contact, controller and sensors.
        seed: of everything that is drawn, and of the tuning.
        jobs: number of processes.
        scheduler: address of a Dask scheduler to work there.
        progress: is told the share that is done.

    Returns:
        The block `panda` of `summary.json`.

    Raises:
        TactfulError: if a number is out of range, the scheduler does not answer, or an extra is missing.
    """
    config = bench or BenchConfig()
    out.mkdir(parents=True, exist_ok=True)
    before = earlier(out)
    with connected(scheduler) as client:
        figures, report, evidence = summarise_bench(config, seed, jobs, client, progress)
    np.savez_compressed(out / "evidence_panda.npz", allow_pickle=False, **evidence)
    bench_pictures(figures, report, config, out)
    write(out, {**before, "panda": figures})
    return figures
