"""Expected or unexpected impact: the simulated experiment of the aim-aware paper."""

from tactful.studies.aim_aware._bands import Bands
from tactful.studies.aim_aware._evidence import cases, judge
from tactful.studies.aim_aware._study import aim_aware_study

__all__ = ["Bands", "aim_aware_study", "cases", "judge"]
