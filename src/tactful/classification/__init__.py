"""What a contact is."""

from tactful.classification._aim_aware import AimAware, AimAwareTrace
from tactful.classification._aim_aware_config import AimAwareConfig
from tactful.classification._aim_aware_result import VERDICTS, AimAwareResult, ImpactVerdict, JointEvidence, Reason
from tactful.classification._kinesthetic import KinestheticClassifier, KinestheticConfig
from tactful.classification._onset import Onset
from tactful.classification._verdict import Classifier, Evidence, Kind, Verdict

__all__ = [
    "VERDICTS",
    "AimAware",
    "AimAwareConfig",
    "AimAwareResult",
    "AimAwareTrace",
    "Classifier",
    "Evidence",
    "ImpactVerdict",
    "JointEvidence",
    "Kind",
    "KinestheticClassifier",
    "KinestheticConfig",
    "Onset",
    "Reason",
    "Verdict",
]
