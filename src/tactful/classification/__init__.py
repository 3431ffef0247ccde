"""What a contact is."""

from tactful.classification._kinesthetic import KinestheticClassifier, KinestheticConfig
from tactful.classification._onset import Onset
from tactful.classification._verdict import Classifier, Evidence, Kind, Verdict

__all__ = ["Classifier", "Evidence", "Kind", "KinestheticClassifier", "KinestheticConfig", "Onset", "Verdict"]
