"""A contact, as the monitor tells it."""

from __future__ import annotations

import json
import math
from dataclasses import asdict, dataclass
from typing import Any, Literal

from tactful.classification import Evidence, Kind
from tactful.isolation import Region

Phase = Literal["began", "changed", "ended"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Location:
    """Where on the arm a contact is and how hard, as the joint torques tell it; see `tactful.isolation.Isolator`."""

    link: str
    """The most probable link."""
    confidence: float
    """Its probability."""
    ambiguous: bool
    """Whether no link is sure."""
    region: Region
    """The most probable part of the arm, see `tactful.isolation.region_of`."""
    region_confidence: float
    """Its probability."""
    point_m: tuple[float, ...] | None
    """The contact point (3,), base axes [m]; None where the torque leaves a set of points."""
    force_n: tuple[float, ...]
    """Force there (3,), base axes [N]."""
    magnitude_n: float
    """Its magnitude [N]."""
    magnitude_interval_n: tuple[float, float]
    """What holds the magnitude with the probability `IsolationConfig.coverage` [N]."""
    several: bool
    """Whether one contact does not explain the torque: then the link is not to be believed."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ContactEvent:
    """What is known of one contact; immutable, and equal to another that says the same.

    Forces and torques act from the environment on the robot. They are what the contact added since just before its
    onset, so a constant bias of the estimate is not in them.
    """

    id: int
    """Number of the contact, from 0; all events of one contact have the same."""
    phase: Phase
    """Whether the contact began, changed (its kind, its link, or by a direction) or ended."""
    kind: Kind
    """What the contact is."""
    onset_s: float
    """When it began, by backward search [s]."""
    detected_s: float
    """When it was detected [s]."""
    end_s: float | None
    """When it ended [s]; None while it lasts."""
    link: str | None
    """The link that is touched; None where it is not known, not sure, or the contact has only just begun."""
    location: Location | None = None
    """Where on the arm, as far as the torque tells; None where no torque or no surface of the arm is known."""
    directions: tuple[str, ...]
    """The directions in which it was detected, of x, y and z of the base."""
    force_n: tuple[float, ...]
    """Force at the tip (3,), at the last change of the event, base axes [N]."""
    peak_force_n: float
    """Largest magnitude of that force so far [N]."""
    torque_ext_nm: tuple[float, ...]
    """External joint torque (n,) at the last change [Nm]; empty where only a wrench is known."""
    velocity_m_s: tuple[float, ...] | None
    """Velocity of the tip (3,) just before the onset, base axes [m/s]; None where it is not known."""
    confidence: float
    """How sure the classifier is of the kind, in [0, 1]."""
    evidence: tuple[Evidence, ...]
    """Which rules decided, with their values and thresholds."""
    reason: str | None = None
    """What went wrong in an impact that is not the expected one, as far as that is known."""
    sigma_min: float | None
    """Smallest singular value of the tip's Jacobian at the detection: a force is uncertain where it is small."""
    damped: bool
    """Whether the force was damped near a singularity, and is too small along the lost direction."""

    @property
    def decision(self) -> str:
        """What decided last, in words; empty as long as nothing has.

        That is the last evidence with a threshold: what follows it only explains it.
        """
        decisive = [item for item in self.evidence if item.threshold is not None] or self.evidence[-1:]
        return decisive[-1].text if decisive else ""

    def to_dict(self) -> dict[str, Any]:
        """Return plain numbers, strings and lists; what is not a finite number is None."""
        return _plain(asdict(self))  # type: ignore[no-any-return]

    def to_json(self) -> str:
        """Return the event as one line of JSON."""
        return json.dumps(self.to_dict(), allow_nan=False)


def _plain(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value
