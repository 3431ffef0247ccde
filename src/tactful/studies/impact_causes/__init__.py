"""What went wrong with a planned impact: learnt on simulated runs, measured on others."""

from tactful.studies.impact_causes._runs import CAUSES, ImpactRun, simulate_causes
from tactful.studies.impact_causes._study import impact_causes_study

__all__ = ["CAUSES", "ImpactRun", "impact_causes_study", "simulate_causes"]
