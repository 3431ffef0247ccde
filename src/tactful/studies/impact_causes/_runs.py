"""Simulated impacts with which one thing is wrong."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from tactful.classification import AimAware, AimAwareConfig, AimAwareResult
from tactful.detection import ImpactConfig
from tactful.estimation import MomentumObserver, ObserverConfig
from tactful.impacts import ImpactPlan
from tactful.simulation.planar import PlanarConfig, SensorsConfig, planar_robot, simulate_impact
from tactful.studies.impact_causes._causes import TASKS, Cause, Task

IMPACT = ImpactConfig(r_b_nm_s=(600.0, 600.0, math.inf), bandpass_hz=30.0)
"""When an impact is detected, by the controller and by the classifier. Without the band-pass the noisy sensors show as
much as a light object that gives way."""
CONFIG = AimAwareConfig.table1("medium", impact=IMPACT, bandwidth_hz=PlanarConfig().observer_gain / (2 * math.pi))
"""The settings of the classifier."""

_ALPHA_DEG, _X_M = (60.0, 120.0), (0.2, 0.4)


@dataclass(frozen=True, slots=True, eq=False)
class ImpactRun:
    """An impact of which it is known what is wrong.

    Attributes:
        cause: its name, of the causes of a task.
        alpha_deg: angle of approach [deg].
        beta_deg: inclination of the surface [deg].
        plan: what was planned.
        result: what the aim-aware classifier found.
    """

    cause: str
    alpha_deg: float
    beta_deg: float
    plan: ImpactPlan
    result: AimAwareResult


def simulate_causes(
    task: str,
    runs: int,
    rng: np.random.Generator,
    *,
    sensors: SensorsConfig | None = None,
    config: AimAwareConfig = CONFIG,
) -> list[ImpactRun]:
    """Simulate impacts of the planar arm from random directions on random places.

    Args:
        task: what the plan counts on, a name of `TASKS`.
        runs: of each cause.
        rng: what directions, places and figures are drawn from.
        sensors: what the sensors make of the truth.
        config: the settings of the classifier.
    """
    kind = TASKS[task]
    return [
        simulate_cause(name, cause, kind, rng, sensors=sensors, config=config)
        for name, cause in kind.causes.items()
        for _ in range(runs)
    ]


def simulate_cause(
    name: str,
    cause: Cause,
    task: Task,
    rng: np.random.Generator,
    *,
    sensors: SensorsConfig | None = None,
    config: AimAwareConfig = CONFIG,
) -> ImpactRun:
    """Simulate one impact, and let the classifier judge it; see `simulate_causes`."""
    alpha_deg, x_m, beta_deg = (rng.uniform(*bounds) for bounds in (_ALPHA_DEG, _X_M, cause.beta_deg))
    common: dict[str, Any] = {"impact": config.impact, "sensors": sensors or SensorsConfig()}
    planar = PlanarConfig(**task.counts_on | cause.draw(rng), **common)
    run = simulate_impact(alpha_deg, x_m, beta_deg, planar, seed=int(rng.integers(2**31)))
    plan = run.plan
    if task.recorded:
        nominal = simulate_impact(alpha_deg, x_m, 0.0, PlanarConfig(**task.counts_on, impact=config.impact))
        plan = replace(ImpactPlan.from_recordings([nominal.recording()], contacts=plan.contacts), turn=plan.turn)
    late_s = rng.uniform(*cause.late_s)
    plan = replace(plan, t_d_s=plan.t_d_s - late_s, post_t_s=plan.post_t_s - late_s)
    observing = ObserverConfig(bandwidth_hz=config.bandwidth_hz, joint_flexibility=True)
    r = MomentumObserver(planar_robot(), observing).run(run.t, run.q, run.dq, run.tau)
    aim = AimAware(plan, config)
    aim.run(run.t, run.q, run.dq, r)
    return ImpactRun(name, run.alpha_deg, run.beta_deg, plan, aim.result)
