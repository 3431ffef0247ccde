"""Intended impacts: what is planned, what a rigid model says that follows, and the force of a compliant contact."""

from tactful.impacts._hunt_crossley import (
    CompliantContactConfig,
    contact_force,
    damping_for,
    friction_force,
    restitution,
)
from tactful.impacts._impact_map import ImpactMapError, ImpactResult, impact, simultaneous_inelastic
from tactful.impacts._plan import ContactPoint, ImpactPlan, ImpactPlanError

__all__ = [
    "CompliantContactConfig",
    "ContactPoint",
    "ImpactMapError",
    "ImpactPlan",
    "ImpactPlanError",
    "ImpactResult",
    "contact_force",
    "damping_for",
    "friction_force",
    "impact",
    "restitution",
    "simultaneous_inelastic",
]
