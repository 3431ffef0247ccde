"""Simulated impacts with which one thing is wrong."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tactful.classification import AimAware, AimAwareConfig, AimAwareResult
from tactful.detection import ImpactConfig
from tactful.estimation import MomentumObserver, ObserverConfig
from tactful.impacts import ImpactPlan
from tactful.simulation.planar import PlanarConfig, SensorsConfig, planar_robot, simulate_impacts

Array = NDArray[np.float64]

IMPACT = ImpactConfig(r_b_nm_s=(3000.0, 3000.0, math.inf))
"""When an impact is detected, by the controller and by the classifier: above the noise of the noisy sensors."""
CONFIG = AimAwareConfig.table1("medium", impact=IMPACT, bandwidth_hz=PlanarConfig().observer_gain / (2 * math.pi))
"""The settings of the classifier."""

_ALPHA_DEG, _X_M = (60.0, 120.0), (0.2, 0.4)
_LEVEL_DEG = 0.5
"""Largest inclination of runs in which it is not what is wrong [deg]."""
_GROUP = 10
"""Runs that share what was drawn for them, but for their geometry."""

Draw = Callable[[np.random.Generator], dict[str, Any]]


def _task(low: float, high: float) -> Draw:
    return lambda rng: {"task": {"surface_offset_m": rng.uniform(low, high)}}


def _contact(name: str, low: float, high: float) -> Draw:
    return lambda rng: {"contact": {name: math.exp(rng.uniform(math.log(low), math.log(high)))}}


CAUSES: Mapping[str, tuple[tuple[float, float], Draw]] = MappingProxyType(
    {
        "as planned": ((-_LEVEL_DEG, _LEVEL_DEG), lambda rng: {}),
        "inclined +": ((1.5, 8.0), lambda rng: {}),
        "inclined -": ((-8.0, -1.5), lambda rng: {}),
        "too near": ((-_LEVEL_DEG, _LEVEL_DEG), _task(0.006, 0.025)),
        "too far": ((-_LEVEL_DEG, _LEVEL_DEG), _task(-0.025, -0.006)),
        "rebound": ((-_LEVEL_DEG, _LEVEL_DEG), _contact("restitution", 0.3, 0.7)),
        "soft": ((-_LEVEL_DEG, _LEVEL_DEG), _contact("stiffness", 1e5, 1e6)),
        "grip": ((-_LEVEL_DEG, _LEVEL_DEG), _contact("friction", 0.1, 0.4)),
    }
)
"""What is wrong, by the inclination of the surface [deg] and by what is drawn for the simulation: nothing; the surface
is inclined; it is nearer to the arm than planned, or further; the tool rebounds; the surface is soft; it holds the tool
back by friction that the plan does not know."""


@dataclass(frozen=True, slots=True, eq=False)
class ImpactRun:
    """An impact of which it is known what is wrong.

    Attributes:
        cause: a name of `CAUSES`.
        beta_deg: inclination of the surface [deg].
        plan: what was planned.
        result: what the aim-aware classifier found.
    """

    cause: str
    beta_deg: float
    plan: ImpactPlan
    result: AimAwareResult


def simulate_causes(
    runs: int, rng: np.random.Generator, *, sensors: SensorsConfig | None = None, config: AimAwareConfig = CONFIG
) -> list[ImpactRun]:
    """Simulate impacts of the planar arm from random directions on random places.

    Args:
        runs: of each cause.
        rng: what directions, places and figures are drawn from.
        sensors: what the sensors make of the truth.
        config: the settings of the classifier.
    """
    robot = planar_robot()
    observing = ObserverConfig(bandwidth_hz=config.bandwidth_hz, joint_flexibility=True)
    found = []
    for cause, (tilt, draw) in CAUSES.items():
        for begin in range(0, runs, _GROUP):
            count = min(_GROUP, runs - begin)
            cases = np.column_stack([rng.uniform(*bounds, count) for bounds in (_ALPHA_DEG, _X_M, tilt)])
            planar = PlanarConfig(**draw(rng), impact=config.impact, sensors=sensors or SensorsConfig())
            for run in simulate_impacts(cases, planar, seed=int(rng.integers(2**31))):
                r = MomentumObserver(robot, observing).run(run.t, run.q, run.dq, run.tau)
                aim = AimAware(run.plan, config)
                aim.run(run.t, run.q, run.dq, r)
                found.append(ImpactRun(cause, run.beta_deg, run.plan, aim.result))
    return found
