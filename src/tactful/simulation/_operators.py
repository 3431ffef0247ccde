"""People who help, as assumed styles."""

from __future__ import annotations

from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from tactful.simulation._hands import Guide, Hesitation, Push, Tremor

Array = NDArray[np.float64]
Range = tuple[float, float]

_AT_MOST_M = 0.10
"""How far a hand leads the arm [m]."""


@dataclass(frozen=True, kw_only=True)
class Operator:
    """How one person touches an arm. No figure is measured on people: they are assumptions that differ widely.

    Attributes:
        name: its name.
        experienced: whether the person knows what the arm needs.
        reaction_s: time from a collision to the touch [s].
        rise_s: time in which the force rises [s].
        hold_s: time for which it is held [s].
        force_n: the force [N].
        astray_rad: standard deviation of the force's direction from the one that is needed [rad].
        along: range of the angle between the force and the plane across the motion, positive with the motion [rad].
        guides: how often the hand leads as a spring and a damper, instead of pushing with a force.
        stiffness_n_m: of such a hand [N/m].
        damping_ns_m: of such a hand [Ns/m].
        tremor_n: amplitude of the tremor [N].
        hesitates: how often the hand pauses while its force rises.
    """

    name: str
    experienced: bool
    reaction_s: Range
    rise_s: Range
    hold_s: Range
    force_n: Range
    astray_rad: float
    along: Range
    guides: float
    stiffness_n_m: Range = (150.0, 400.0)
    damping_ns_m: Range = (5.0, 20.0)
    tremor_n: float
    hesitates: float

    def direction(self, needed: Array, rng: np.random.Generator) -> Array:
        """Return the direction of the force (3,) where `needed` (3,) would be the best."""
        aside = np.cross(needed, rng.standard_normal(3))
        angle = self.astray_rad * rng.standard_normal()
        return np.asarray(np.cos(angle) * needed + np.sin(angle) * aside / np.linalg.norm(aside))

    def across(self, motion: Array, away: Array, rng: np.random.Generator) -> Array:
        """Return a direction (3,) that brings the arm off its way.

        Args:
            motion: direction of the motion (3,).
            away: a direction that is free (3,); the force has a part in it.
            rng: the source of the choice.
        """
        aside = rng.standard_normal(3)
        aside -= (aside @ motion) * motion
        if aside @ away < 0:
            aside = -aside
        angle = rng.uniform(*self.along)
        return np.asarray(np.cos(angle) * aside / np.linalg.norm(aside) + np.sin(angle) * motion)

    def hand(
        self, link: str, point_m: Array, position_m: Array, direction: Array, start_s: float, rng: np.random.Generator
    ) -> Push | Guide:
        """Return a hand of this person.

        Args:
            link: name of the link that it touches.
            point_m: the point that it touches, in the link's frame (3,) [m].
            position_m: where that point is now, in the base (3,) [m].
            direction: of the force (3,).
            start_s: when it touches [s].
            rng: the source of everything else.
        """
        force = float(rng.uniform(*self.force_n))
        wanted = {
            "link": link,
            "point_m": tuple(point_m.tolist()),
            "start_s": start_s,
            "rise_s": float(rng.uniform(*self.rise_s)),
            "hold_s": float(rng.uniform(*self.hold_s)),
            "fall_s": float(rng.uniform(0.08, 0.3)),
            "hesitation": Hesitation(share=float(rng.uniform(0.2, 0.5)), pause_s=float(rng.uniform(0.1, 0.4)))
            if rng.uniform() < self.hesitates
            else None,
            "tremor": Tremor(
                amplitude_n=tuple((self.tremor_n * rng.uniform(0.3, 1.0, 3)).tolist()),
                frequency_hz=tuple(rng.uniform(8.0, 12.0, 3).tolist()),
                phase_rad=tuple(rng.uniform(0.0, 2 * np.pi, 3).tolist()),
            ),
        }
        guides = rng.uniform() < self.guides
        stiffness, damping = (float(rng.uniform(*span)) for span in (self.stiffness_n_m, self.damping_ns_m))
        if not guides:
            return Push(**wanted, force_n=tuple((force * direction).tolist()))  # type: ignore[arg-type]
        reach_m = min(_AT_MOST_M, 1.5 * force / stiffness)
        return Guide(
            **wanted,  # type: ignore[arg-type]
            target_m=tuple((position_m + reach_m * direction).tolist()),
            stiffness_n_m=stiffness,
            damping_ns_m=damping,
            strength_n=force,
        )


_ALL = (
    Operator(
        name="brisk",
        experienced=True,
        reaction_s=(0.4, 0.8),
        rise_s=(0.08, 0.18),
        hold_s=(0.5, 1.0),
        force_n=(10, 22),
        astray_rad=0.2,
        along=(-0.2, 0.9),
        guides=0.3,
        tremor_n=0.1,
        hesitates=0.05,
    ),
    Operator(
        name="calm",
        experienced=True,
        reaction_s=(0.6, 1.2),
        rise_s=(0.25, 0.5),
        hold_s=(0.7, 1.3),
        force_n=(7, 15),
        astray_rad=0.25,
        along=(-0.3, 0.7),
        guides=0.5,
        tremor_n=0.15,
        hesitates=0.1,
    ),
    Operator(
        name="leading",
        experienced=True,
        reaction_s=(0.5, 1.0),
        rise_s=(0.12, 0.3),
        hold_s=(0.6, 1.2),
        force_n=(10, 25),
        astray_rad=0.2,
        along=(-0.4, 1.2),
        guides=1.0,
        stiffness_n_m=(250.0, 600.0),
        damping_ns_m=(10.0, 30.0),
        tremor_n=0.2,
        hesitates=0.1,
    ),
    Operator(
        name="hesitant",
        experienced=False,
        reaction_s=(0.8, 1.6),
        rise_s=(0.2, 0.6),
        hold_s=(0.5, 1.2),
        force_n=(6, 14),
        astray_rad=0.5,
        along=(-0.6, 0.7),
        guides=0.4,
        tremor_n=0.3,
        hesitates=0.7,
    ),
    Operator(
        name="abrupt",
        experienced=False,
        reaction_s=(0.3, 0.7),
        rise_s=(0.03, 0.09),
        hold_s=(0.3, 0.7),
        force_n=(10, 30),
        astray_rad=0.5,
        along=(-0.8, 0.9),
        guides=0.1,
        tremor_n=0.2,
        hesitates=0.0,
    ),
    Operator(
        name="shaky",
        experienced=False,
        reaction_s=(0.5, 1.3),
        rise_s=(0.12, 0.4),
        hold_s=(0.5, 1.2),
        force_n=(7, 18),
        astray_rad=0.6,
        along=(-0.8, 0.8),
        guides=0.4,
        tremor_n=1.2,
        hesitates=0.3,
    ),
)
OPERATORS = MappingProxyType({operator.name: operator for operator in _ALL})
"""The assumed operators by name: two of the experienced (`brisk`, `calm`) and two of the others (`hesitant`, `abrupt`)
are the four of the paper's experiment, the other two are further away."""
