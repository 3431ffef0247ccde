"""From labelled recordings to a classifier, and to a threshold with a stated guarantee."""

from tactful.learning._decisions import Decision, decisions_of, operator_of
from tactful.learning._errors import LearningError
from tactful.learning._guarantee import Guarantee, certify, events_needed, upper_bound
from tactful.learning._train import Seen, Training, seen, train
from tactful.learning._tune import Candidates, Tuning, tune

__all__ = [
    "Candidates",
    "Decision",
    "Guarantee",
    "LearningError",
    "Seen",
    "Training",
    "Tuning",
    "certify",
    "decisions_of",
    "events_needed",
    "operator_of",
    "seen",
    "train",
    "tune",
    "upper_bound",
]
