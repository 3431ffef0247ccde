"""What may be wrong with an impact, by what its plan counts on."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

import numpy as np

LEVEL_DEG = 0.5
"""Largest inclination of runs in which it is not what is wrong [deg]."""
_MASS_KG = 10.0
_FRICTION = 0.3

Parts = dict[str, dict[str, Any]]
"""What differs from the assumed arm on a smooth, fixed surface: parts of a `PlanarConfig`."""


@dataclass(frozen=True)
class Cause:
    """Something that is wrong with impacts, or nothing.

    Attributes:
        draw: draws what differs from what the plan counts on.
        beta_deg: inclination of the surface, smallest and largest [deg].
        late_s: how much later than its plan's clock the motion begins, smallest and largest [s].
    """

    draw: Callable[[np.random.Generator], Parts] = lambda rng: {}
    beta_deg: tuple[float, float] = (-LEVEL_DEG, LEVEL_DEG)
    late_s: tuple[float, float] = (0.0, 0.0)


@dataclass(frozen=True)
class Task:
    """A kind of plan.

    Attributes:
        counts_on: what surface the plan counts on.
        recorded: whether its reference after the impact comes from a recorded nominal run, not from the impact map.
        causes: what may be wrong, by name.
    """

    counts_on: Parts
    recorded: bool
    causes: Mapping[str, Cause]


def _between(part: str, name: str, low: float, high: float) -> Cause:
    return Cause(lambda rng: {part: {name: rng.uniform(low, high)}})


def _by_ratio(part: str, name: str, low: float, high: float, **rest: float) -> Cause:
    return Cause(lambda rng: {part: {name: _ratio(rng, low, high), **rest}})


def _ratio(rng: np.random.Generator, low: float, high: float) -> float:
    return math.exp(rng.uniform(math.log(low), math.log(high)))


def _held(rng: np.random.Generator) -> Parts:
    side, end_m = rng.choice(["begin_m", "end_m"]), rng.uniform(0.0, 0.06)
    return {"surface": {side: -end_m if side == "begin_m" else end_m}}


def _gives_way(rng: np.random.Generator) -> Parts:
    mass, support = _ratio(rng, 3.0, 50.0), _ratio(rng, 500.0, 5000.0)
    damping = 2 * rng.uniform(0.1, 0.5) * math.sqrt(mass * support)
    return {"surface": {"mass_kg": mass, "support_n_m": support, "support_ns_m": damping}}


_SUPPORT = {"support_n_m": 1000.0, "support_ns_m": 300.0}
TASKS: Mapping[str, Task] = MappingProxyType(
    {
        "fixed": Task(
            {},
            False,
            {
                "as planned": Cause(),
                "early": Cause(late_s=(-0.08, -0.02)),
                "late": Cause(late_s=(0.02, 0.08)),
                "too near": _between("task", "surface_offset_m", 0.006, 0.025),
                "too far": _between("task", "surface_offset_m", -0.025, -0.006),
                "missed": _between("task", "surface_offset_m", -0.2, -0.15),
                "inclined +": Cause(beta_deg=(1.5, 8.0)),
                "inclined -": Cause(beta_deg=(-8.0, -1.5)),
                "partial": Cause(_held),
                "partial +": _between("surface", "begin_m", 0.01, 0.08),
                "partial -": _between("surface", "end_m", -0.08, -0.01),
                "rebound": _by_ratio("contact", "restitution", 0.3, 0.7),
                "soft": _by_ratio("contact", "stiffness", 1e5, 1e6),
                "grip": _by_ratio("contact", "friction", 0.1, 0.4),
                "gives way": Cause(_gives_way),
            },
        ),
        "rough": Task(
            {part: {"friction": _FRICTION} for part in ("task", "control", "contact")},
            False,
            {"as planned": Cause(), "slip": _between("contact", "friction", 0.0, 0.1)},
        ),
        "object": Task(
            {"surface": {"mass_kg": _MASS_KG, **_SUPPORT}, "task": {"object_mass_kg": _MASS_KG}},
            True,
            {
                "as planned": Cause(),
                "lighter": _by_ratio("surface", "mass_kg", 0.2 * _MASS_KG, 0.5 * _MASS_KG, **_SUPPORT),
                "heavier": _by_ratio("surface", "mass_kg", 2 * _MASS_KG, 5 * _MASS_KG, **_SUPPORT),
            },
        ),
    }
)
"""Plans by what they count on, and what may be wrong.

A smooth and fixed surface: the motion begins before or after its plan's clock; the surface is nearer to the arm than
planned, or further, or not there; it is inclined; it ends below the tool and holds 50 to 80 % of its face, or 45 to
10 %, so that the tool tips over its edge in the sense of the sign; the tool rebounds; the surface is soft; it holds the
tool back by friction; it gives way. A rough surface, with friction: it is slippery. An object that gives way: it is
lighter, or heavier.
"""
