"""Impacts simulated and judged: for each what every threshold would have to be to accept it."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tactful.classification import AimAwareConfig
from tactful.errors import TactfulError
from tactful.learning import THRESHOLDS, Judged, judged_row
from tactful.simulation.planar import PlanarConfig, simulate_impacts
from tactful.studies._parallel import results

Array = NDArray[np.float64]
Task = tuple[Array, PlanarConfig, tuple[AimAwareConfig, ...], int]
_CHUNK = 150


def cases(alpha_deg: ArrayLike, x_imp_m: ArrayLike, beta_deg: ArrayLike) -> Array:
    """Return every combination of approach, place and inclination (k, 3)."""
    axes = np.meshgrid(*(np.asarray(axis, dtype=np.float64) for axis in (alpha_deg, x_imp_m, beta_deg)), indexing="ij")
    return np.stack([axis.ravel() for axis in axes], axis=1)


def judge(
    cases: Array,
    planar: PlanarConfig,
    classifiers: Sequence[AimAwareConfig],
    *,
    seed: int = 0,
    jobs: int = 1,
    client: Any = None,
    progress: Callable[[int], None] = lambda count: None,
) -> tuple[list[Judged], float]:
    """Simulate impacts and let every classifier judge them; nothing depends on the number of jobs.

    Args:
        cases: (k, 3) alpha [deg], x_imp [m], beta [deg].
        planar: arm, task, contact, controller, sensors.
        classifiers: the classifiers; those that differ in thresholds alone are the same here.
        seed: of the noise of the sensors.
        jobs: number of processes.
        client: of a Dask cluster, to work there.
        progress: is told how many impacts have been judged since it was told last.

    Returns:
        For each classifier what it saw, and the CPU time of the simulation and the classifiers [s].

    Raises:
        TactfulError: if there is no job, or a motion is out of reach.
    """
    if jobs < 1:
        raise TactfulError(f"jobs is {jobs}: it has to be at least 1")
    alike = [_alike(config) for config in classifiers]
    distinct = tuple(dict.fromkeys(alike))
    tasks = [(cases[i : i + _CHUNK], planar, distinct, seed) for i in range(0, len(cases), _CHUNK)]
    parts: dict[int, Array] = {}
    spent = 0.0
    for number, (rows, cpu_s) in results(_work, tasks, jobs=jobs, client=client):
        parts[number] = rows
        spent += cpu_s
        progress(len(tasks[number][0]))
    rows = np.concatenate([parts[i] for i in range(len(tasks))], axis=1)  # (distinct, k, 6 + n)
    return [Judged.from_rows(rows[distinct.index(config)]) for config in alike], spent


def _alike(config: AimAwareConfig) -> AimAwareConfig:
    """Return the classifier with thresholds that all have in common: evidence does not depend on them."""
    default = AimAwareConfig()
    return config.model_copy(update={name: getattr(default, name) for name in THRESHOLDS})


def _work(task: Task) -> tuple[Array, float]:
    cases, planar, classifiers, seed = task
    begin = time.process_time()
    runs = simulate_impacts(cases, planar, seed)
    rows = np.array([[judged_row(run, config) for run in runs] for config in classifiers])
    return rows, time.process_time() - begin
