"""Intended impacts: what is planned, and what a rigid model says that follows."""

from tactful.impacts._plan import ContactPoint, ImpactPlan, ImpactPlanError

__all__ = ["ContactPoint", "ImpactPlan", "ImpactPlanError"]
