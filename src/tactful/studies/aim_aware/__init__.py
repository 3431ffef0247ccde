"""Expected or unexpected impact: the experiments of the aim-aware paper, simulated."""

from tactful.studies.aim_aware._bands import Bands
from tactful.studies.aim_aware._evidence import cases, judge
from tactful.studies.aim_aware._panda_study import panda_study
from tactful.studies.aim_aware._study import aim_aware_study

__all__ = ["Bands", "aim_aware_study", "cases", "judge", "panda_study"]
