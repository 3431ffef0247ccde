"""Collision or cooperation from the direction of the force against the motion."""

from __future__ import annotations

from typing import Annotated, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from tactful.classification._onset import Onset
from tactful.classification._verdict import Evidence, Verdict
from tactful.config import Config

Array = NDArray[np.float64]
PositiveFloat = Annotated[float, Field(gt=0)]
NonNegativeFloat = Annotated[float, Field(ge=0)]

_AXES = "xyz"


class KinestheticConfig(Config):
    """The classifier of the kinesthetic paper, see `KinestheticClassifier`."""

    rule: Literal["floored", "literal", "angle"] = "floored"
    """Variant of A1 and A2. Paper: "literal"."""
    gamma: PositiveFloat | None = None
    """Threshold of A2; None takes 6.2 (the paper's) for "literal" and 3.34 for "floored"."""
    gamma_deg: Annotated[float, Field(gt=0, le=90)] = 30.0
    """Largest angle between the force and the reversed motion that is a collision, for "angle" [deg]."""
    floor: Annotated[float, Field(gt=0, lt=0.5)] = 0.1
    """Least magnitude of a component of the unit velocity, for "floored"."""
    secant_s: NonNegativeFloat = 0.03
    """Time over which the change of the force is taken, at most to the detection; 0 is one sample [s]. Paper: 0."""
    velocity_s: NonNegativeFloat = 0.02
    """Time before the contact over which the velocity is averaged; 0 is one sample [s]. Paper: 0."""
    standstill_m_s: NonNegativeFloat = 0.01
    """Speed below which the tip is at rest, and the direction of its velocity noise [m/s]. Paper: 0."""

    @property
    def threshold(self) -> float:
        """The threshold of A2 that is in force for "literal" and "floored"."""
        return self.gamma if self.gamma is not None else {"literal": 6.2}.get(self.rule, 3.34)


class KinestheticClassifier:
    r"""Tell a collision with a static obstacle from a person who helps: Algorithm 2 of the paper.

    With the change of the external force dF at the onset and the tip's velocity v before it, u their unit vectors:

    - A1: dF_i v_i > 0 for a detected direction i: the force acts with the motion, so a person cooperates.
    - A2: else, || u_dF \oslash u_v ||_2 < gamma (componentwise division): the force opposes the motion along it, so it
      is a collision; if not, cooperation.

    "literal" is that. It is singular where a component of v vanishes, so "floored" (the default) takes no component of
    u_v smaller than `floor` in A2 and looks away from such directions in A1. "angle" does not depend on the axes:
    collision if the angle between dF and -v is below gamma_deg, else cooperation.

    At standstill v has no direction. A static obstacle cannot begin to push an arm at rest: if the tip then moves with
    the force, it is cooperation; if it does not move, the contact stays unclassified. That rule is ours.

    The confidence says how far the value is from its threshold, 1/2 at the threshold; it is no calibrated probability.

    Source: J. Salt Ducaju et al. 2022, doi:10.1109/RO-MAN53752.2022.9900800, (5), (6), Algorithm 2. Different from it:
    (5) and (6) take the three linear components of the velocity; dF is a secant, since the derivative at the onset is
    noise.
    """

    def __init__(self, config: KinestheticConfig | None = None) -> None:
        self.config = config or KinestheticConfig()

    def classify(self, onset: Onset) -> Verdict:
        """Return collision, cooperation, or contact where the motion is not known."""
        config = self.config
        v = onset.velocity_before_m_s(config.velocity_s)
        if v is None:
            text = "unclassified: the velocity of the arm is not known (needs q and dq)"
            return Verdict("contact", 0.5, (Evidence("no velocity", None, None, text),))
        dF = onset.force_change_n(config.secant_s)
        if not (np.linalg.norm(dF) > 0 and np.linalg.norm(v) >= config.standstill_m_s and np.any(v)):
            return self._at_rest(onset, dF, v)
        u_dF, u_v = dF / np.linalg.norm(dF), v / np.linalg.norm(v)
        return self._by_angle(u_dF, u_v) if config.rule == "angle" else self._by_components(u_dF, u_v, onset.directions)

    def _at_rest(self, onset: Onset, dF: Array, v: Array) -> Verdict:
        assert onset.velocity_m_s is not None
        limit = self.config.standstill_m_s
        after = onset.velocity_m_s[-1]
        with_force = float(after @ dF / max(float(np.linalg.norm(dF)), 1e-12))
        speed = float(np.linalg.norm(v)) * 1e3
        if with_force > limit:
            text = f"cooperation: the tip was at rest ({speed:.1f} mm/s) and moves with the force, {with_force:.3f} m/s"
            return Verdict(
                "cooperation", with_force / (with_force + limit), (Evidence("standstill", with_force, limit, text),)
            )
        text = f"unclassified: the tip is at rest ({speed:.1f} mm/s) and the force does not move it"
        return Verdict("contact", 0.5, (Evidence("standstill", with_force, limit, text),))

    def _by_components(self, u_dF: Array, u_v: Array, directions: NDArray[np.bool_]) -> Verdict:
        floored = self.config.rule == "floored"
        floor = self.config.floor if floored else 0.0
        along = np.where(directions & (np.abs(u_v) > floor), u_dF * u_v, 0.0)  # (3,)
        i = int(np.argmax(along))
        if along[i] > 0:
            value = float(along[i])
            text = f"cooperation: force along {'-+'[int(u_dF[i] > 0)]}{_AXES[i]} with the motion"
            return Verdict("cooperation", 0.5 + 0.5 * value, (Evidence("A1", value, 0.0, text),))
        gamma = self.config.threshold
        divisor = np.maximum(np.abs(u_v), floor)
        with np.errstate(divide="ignore", invalid="ignore"):
            ratio = np.where(u_dF == 0, 0.0, np.abs(u_dF) / divisor)
        value = float(np.linalg.norm(ratio))
        if value < gamma:
            text = f"collision: force against the motion ({value:.2f} < {gamma:g})"
            return Verdict("collision", gamma / (gamma + value), (Evidence("A2", value, gamma, text),))
        text = f"cooperation: force across the motion ({value:.2f} >= {gamma:g})"
        confidence = 1.0 if np.isinf(value) else value / (gamma + value)
        return Verdict("cooperation", confidence, (Evidence("A2", value, gamma, text),))

    def _by_angle(self, u_dF: Array, u_v: Array) -> Verdict:
        limit = self.config.gamma_deg
        angle = float(np.degrees(np.arccos(np.clip(-(u_dF @ u_v), -1.0, 1.0))))
        kind: Literal["collision", "cooperation"] = "collision" if angle < limit else "cooperation"
        sense = "against" if angle < limit else "across" if angle <= 90 else "with"
        text = f"{kind}: force {sense} the motion ({angle:.0f} deg from its opposite, limit {limit:g} deg)"
        confidence = limit / (limit + angle) if kind == "collision" else angle / (limit + angle)
        return Verdict(kind, confidence, (Evidence("angle", angle, limit, text),))
