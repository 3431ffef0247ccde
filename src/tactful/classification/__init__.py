"""What a contact is."""

from tactful.classification._aim_aware import AimAware, AimAwareTrace
from tactful.classification._aim_aware_config import AimAwareConfig
from tactful.classification._aim_aware_result import VERDICTS, AimAwareResult, ImpactVerdict, JointEvidence, Reason
from tactful.classification._impact_cause import ImpactCause, ImpactCauses
from tactful.classification._impact_features import IMPACT_FEATURES, ImpactFeatures, impact_features
from tactful.classification._kinesthetic import KinestheticClassifier, KinestheticConfig
from tactful.classification._onset import Onset
from tactful.classification._verdict import Classifier, Evidence, Kind, Verdict

__all__ = [
    "IMPACT_FEATURES",
    "VERDICTS",
    "AimAware",
    "AimAwareConfig",
    "AimAwareResult",
    "AimAwareTrace",
    "Classifier",
    "Evidence",
    "ImpactCause",
    "ImpactCauses",
    "ImpactFeatures",
    "ImpactVerdict",
    "JointEvidence",
    "Kind",
    "KinestheticClassifier",
    "KinestheticConfig",
    "Onset",
    "Reason",
    "Verdict",
    "impact_features",
]
