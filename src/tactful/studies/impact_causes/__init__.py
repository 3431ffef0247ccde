"""What went wrong with a planned impact: learnt on simulated runs, measured on others."""

from tactful.studies.impact_causes._causes import TASKS, Cause, Task
from tactful.studies.impact_causes._runs import CONFIG, ImpactRun, simulate_causes
from tactful.studies.impact_causes._study import impact_causes_study, planar_causes

__all__ = ["CONFIG", "TASKS", "Cause", "ImpactRun", "Task", "impact_causes_study", "planar_causes", "simulate_causes"]
