"""Expected or unexpected impact: the simulated experiment of the aim-aware paper."""

from tactful.studies.aim_aware._bands import Bands
from tactful.studies.aim_aware._evidence import Judged, cases, judge
from tactful.studies.aim_aware._study import aim_aware_study
from tactful.studies.aim_aware._tune import tune

__all__ = ["Bands", "Judged", "aim_aware_study", "cases", "judge", "tune"]
