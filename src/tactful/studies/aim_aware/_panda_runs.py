"""The impacts of the experiment with an arm on the bench: nominal runs, runs to tune on, runs to report."""

from __future__ import annotations

import functools
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tactful.errors import TactfulError
from tactful.impacts import ImpactPlan
from tactful.learning import LabelledImpact
from tactful.simulation.impact_bench import BenchConfig, BenchPlan, plan_strike, strike
from tactful.studies._parallel import results

Array = NDArray[np.float64]

MODEL, DATA = "model_based", "data_driven"
"""Where the post-impact reference comes from: the rigid impact map, or recorded nominal runs."""
ALPHA_DEG = (100.0, 110.0, 120.0, 130.0)
BETA_DEG = np.arange(-20.0, 20.1, 2.0)
"""The paper's sweep."""
NOMINAL = 4
"""Recorded nominal runs of each approach that its data-driven reference is averaged from."""
_CHUNK = 14
_BEFORE_S = 0.3
"""How much of a run is kept before the planned impact [s]."""
_SEEDS = {"nominal": 1, "tune": 2, "report": 3}
"""Runs of different use share no noise."""


@dataclass(frozen=True)
class StrikeTask:
    """Impacts of one approach, for one use."""

    bench: BenchConfig
    use: str
    alpha_deg: float
    beta_deg: tuple[float, ...]
    seeds: tuple[tuple[int, ...], ...]


@dataclass(frozen=True, eq=False)
class BenchRuns:
    """Impacts with both references.

    Attributes:
        cases: (k, 2) alpha and beta [deg].
        runs: by reference, the k impacts.
    """

    cases: Array
    runs: dict[str, list[LabelledImpact]]


def strike_tasks(bench: BenchConfig, use: str, beta_deg: ArrayLike, seed: int) -> list[StrikeTask]:
    """Return the tasks for a sweep over all approaches; an inclination that comes again is another run of it."""
    tasks = []
    for alpha in ALPHA_DEG:
        seen: dict[float, int] = {}
        cases = []
        for beta in np.asarray(beta_deg, dtype=np.float64).tolist():
            seen[beta] = seen.get(beta, 0) + 1
            cases.append((beta, (seed, _SEEDS[use], round(alpha), seen[beta])))
        for i in range(0, len(cases), _CHUNK):
            betas, seeds = zip(*cases[i : i + _CHUNK], strict=True)
            tasks.append(StrikeTask(bench, use, alpha, betas, seeds))
    return tasks


def bench_runs(
    tasks: Sequence[StrikeTask],
    *,
    jobs: int,
    client: Any,
    progress: Callable[[int], None],
) -> tuple[dict[str, BenchRuns], float]:
    """Simulate tasks, with nominal ones among them, and put each approach's data-driven reference beside the model's.

    Returns:
        For each use but the nominal one its impacts, and the CPU time [s].
    """
    parts: dict[int, list[LabelledImpact]] = {}
    plans: dict[float, ImpactPlan] = {}
    spent = 0.0
    for number, (found, plan, cpu_s) in results(work, tasks, jobs=jobs, client=client):
        parts[number] = found
        if plan is not None:
            plans[tasks[number].alpha_deg] = plan
        spent += cpu_s
        progress(len(tasks[number].beta_deg))
    uses: dict[str, BenchRuns] = {}
    for use in dict.fromkeys(task.use for task in tasks if task.use != "nominal"):
        cases: list[tuple[float, float]] = []
        modelled: list[LabelledImpact] = []
        for number, task in enumerate(tasks):
            if task.use == use:
                cases += [(task.alpha_deg, beta) for beta in task.beta_deg]
                modelled += parts[number]
        recorded = [replace(run, plan=plans[alpha]) for run, (alpha, _) in zip(modelled, cases, strict=True)]
        uses[use] = BenchRuns(np.array(cases), {MODEL: modelled, DATA: recorded})
    return uses, spent


def work(task: StrikeTask) -> tuple[list[LabelledImpact], ImpactPlan | None, float]:
    """Simulate the impacts of a task; of a nominal one return the plan that its recordings make, too."""
    begin = time.process_time()
    planned = _planned(task.alpha_deg, task.bench)
    found, recordings, impacts = [], [], []
    for beta, seed in zip(task.beta_deg, task.seeds, strict=True):
        run = strike(planned, beta, task.bench, seed)
        rows = run.t >= planned.impact.t_d_s - _BEFORE_S
        t, q, dq, r = (np.ascontiguousarray(x[rows]) for x in (run.t, run.q, run.dq, run.r))
        name = f"alpha {task.alpha_deg:g} deg, beta {beta:g} deg"
        found.append(LabelledImpact(name, planned.impact, t, q, dq, r, run.touch_s, expected=False))
        if task.use == "nominal" and len(run.detected_s):
            recordings.append(run.recording())
            impacts.append(float(run.detected_s[0]))
    if task.use == "nominal" and not recordings:
        raise TactfulError(
            f"bench: no nominal impact at {task.alpha_deg:g} deg is felt: the controller's r_b is too high"
        )
    plan = None
    if recordings:
        plan = ImpactPlan.from_recordings(recordings, impacts, contacts=planned.impact.contacts)
        plan = plan.with_turn(planned.robot)
    return found, plan, time.process_time() - begin


@functools.lru_cache(maxsize=len(ALPHA_DEG))
def _planned(alpha_deg: float, bench: BenchConfig) -> BenchPlan:
    return plan_strike(alpha_deg, bench)
