"""From labelled recordings to a classifier, and to a threshold with a stated guarantee."""

from tactful.evaluation import operator_of
from tactful.learning._decisions import Decision, decisions_of
from tactful.learning._errors import LearningError
from tactful.learning._guarantee import Guarantee, certify, events_needed, upper_bound
from tactful.learning._impacts import (
    THRESHOLDS,
    Judged,
    LabelledImpact,
    judged_row,
    planar_impacts,
    within,
)
from tactful.learning._train import Seen, Training, seen, train
from tactful.learning._tune import Candidates, Tuning, tune
from tactful.learning._tune_impacts import ImpactRates, ImpactTuning, thresholds_for, tune_impacts

__all__ = [
    "THRESHOLDS",
    "Candidates",
    "Decision",
    "Guarantee",
    "ImpactRates",
    "ImpactTuning",
    "Judged",
    "LabelledImpact",
    "LearningError",
    "Seen",
    "Training",
    "Tuning",
    "certify",
    "decisions_of",
    "events_needed",
    "judged_row",
    "operator_of",
    "planar_impacts",
    "seen",
    "thresholds_for",
    "train",
    "tune",
    "tune_impacts",
    "upper_bound",
    "within",
]
