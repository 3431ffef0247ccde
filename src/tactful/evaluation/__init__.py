"""How good a monitor is: its events against the truth, with intervals, and truth made from forces that are known."""

from tactful.evaluation._errors import EvaluationError
from tactful.evaluation._figures import Confusion, ContactFigures, Figures, by_operator, grouped
from tactful.evaluation._find import find_recordings
from tactful.evaluation._force_truth import ForceError, force_error, labels_from_wrench
from tactful.evaluation._identified import identified_force
from tactful.evaluation._inject import InjectedContact, inject
from tactful.evaluation._labels import LABEL_KINDS, check_labels
from tactful.evaluation._match import EARLY_S, LATE_S, Match, Matching, label_at, match_events
from tactful.evaluation._operator import operator_of
from tactful.evaluation._outcome import Outcome, evaluate
from tactful.evaluation._random_contacts import random_contacts
from tactful.evaluation._statistics import Rate, Share, Spread

__all__ = [
    "EARLY_S",
    "LABEL_KINDS",
    "LATE_S",
    "Confusion",
    "ContactFigures",
    "EvaluationError",
    "Figures",
    "ForceError",
    "InjectedContact",
    "Match",
    "Matching",
    "Outcome",
    "Rate",
    "Share",
    "Spread",
    "by_operator",
    "check_labels",
    "evaluate",
    "find_recordings",
    "force_error",
    "grouped",
    "identified_force",
    "inject",
    "label_at",
    "labels_from_wrench",
    "match_events",
    "operator_of",
    "random_contacts",
]
