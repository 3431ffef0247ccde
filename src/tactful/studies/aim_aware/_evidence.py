"""Impacts simulated and judged: for each what every threshold would have to be to accept it."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass
from multiprocessing import get_context

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tactful.classification import AimAware, AimAwareConfig
from tactful.errors import TactfulError
from tactful.simulation.planar import PlanarConfig, simulate_impacts

Array = NDArray[np.float64]
_CHUNK = 150


@dataclass(frozen=True, eq=False)
class Judged:
    """How one classifier saw k impacts; thresholds do not matter for it, so they can be chosen afterwards.

    Attributes:
        timing_s: |t_j - t_d|, the largest (k,) [s].
        position_rad: largest distance from q_d(t_d) at an impact (k,) [rad].
        spacing_s: longest time between two impacts (k,) [s].
        needed_rad_s: least margin e_m of each joint that holds (k, n); inf where no impact was felt or no verdict came
            [rad/s].
        turn_rad: how far the tip was turned from its planned angle at the end of the time that is judged (k,); nan
            where no impact was felt [rad].
        verdict_s: time from the first impact to the verdict (k,); nan where there is none [s].
    """

    timing_s: Array
    position_rad: Array
    spacing_s: Array
    needed_rad_s: Array
    turn_rad: Array
    verdict_s: Array

    def accepted(self, config: AimAwareConfig) -> NDArray[np.bool_]:
        """Which impacts are expected (k,), under the thresholds of a classifier with the same envelope."""
        slack = 1e-9
        return np.asarray(
            (self.timing_s <= config.zeta_s + slack)
            & (self.position_rad <= config.epsilon_rad)
            & (self.spacing_s <= config.iota_s + slack)
            & (self.needed_rad_s <= config.margins(self.needed_rad_s.shape[1])).all(axis=1)
        )

    def select(self, rows: NDArray[np.bool_]) -> Judged:
        """Return some of the impacts."""
        return Judged(*(getattr(self, name)[rows] for name in self.__dataclass_fields__))


def cases(alpha_deg: ArrayLike, x_imp_m: ArrayLike, beta_deg: ArrayLike) -> Array:
    """Return every combination of approach, place and inclination (k, 3)."""
    axes = np.meshgrid(*(np.asarray(axis, dtype=np.float64) for axis in (alpha_deg, x_imp_m, beta_deg)), indexing="ij")
    return np.stack([axis.ravel() for axis in axes], axis=1)


def judge(
    cases: Array,
    planar: PlanarConfig,
    classifiers: Sequence[AimAwareConfig],
    seed: int = 0,
    jobs: int = 1,
    progress: Callable[[int], None] = lambda count: None,
) -> list[Judged]:
    """Simulate impacts and let every classifier judge them; nothing depends on the number of jobs.

    Args:
        cases: (k, 3) alpha [deg], x_imp [m], beta [deg].
        planar: arm, task, contact, controller, sensors.
        classifiers: the classifiers; their thresholds do not matter.
        seed: of the noise of the sensors.
        jobs: number of processes.
        progress: is told how many impacts have been judged since it was told last.

    Returns:
        For each classifier what it saw.

    Raises:
        TactfulError: if there is no job, or a motion is out of reach.
    """
    if jobs < 1:
        raise TactfulError(f"jobs is {jobs}: it has to be at least 1")
    chunks = [cases[i : i + _CHUNK] for i in range(0, len(cases), _CHUNK)]
    parts: dict[int, Array] = {}
    if jobs == 1:
        for i, chunk in enumerate(chunks):
            parts[i] = _work(chunk, planar, classifiers, seed)
            progress(len(chunk))
    else:
        with ProcessPoolExecutor(jobs, mp_context=get_context("spawn")) as pool:
            waiting = {pool.submit(_work, chunk, planar, classifiers, seed): i for i, chunk in enumerate(chunks)}
            for future in as_completed(waiting):
                parts[waiting[future]] = future.result()
                progress(len(chunks[waiting[future]]))
    rows = np.concatenate([parts[i] for i in range(len(chunks))], axis=1)  # (classifiers, k, 5 + n)
    return [
        Judged(part[:, 0], part[:, 1], part[:, 2], part[:, 5:], turn_rad=part[:, 3], verdict_s=part[:, 4])
        for part in rows
    ]


def _work(cases: Array, planar: PlanarConfig, classifiers: Iterable[AimAwareConfig], seed: int) -> Array:
    runs = simulate_impacts(cases, planar, seed)
    return np.array([[_row(AimAware(run.plan, config), run) for run in runs] for config in classifiers])


def _row(aim: AimAware, run: object) -> tuple[float, ...]:
    aim.run(run.t, run.q, run.dq, run.r)  # type: ignore[attr-defined]
    result = aim.result
    first = result.impact_s[0] if result.impact_s else np.nan
    decided = result.verdict in ("expected", "unexpected") and result.judged > 0
    return (
        abs(result.timing_s),
        result.position_rad,
        result.spacing_s,
        float(result.q_end_rad.sum()) if result.judged else np.nan,
        result.decided_s - first if decided and result.decided_s is not None else np.nan,
        *(joint.needed_rad_s if decided else np.inf for joint in result.joints),
    )
