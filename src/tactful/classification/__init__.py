"""What a contact is."""

from tactful.classification._additive import CONTEXTS, AdditiveModel, ModelError
from tactful.classification._aim_aware import AimAware, AimAwareTrace
from tactful.classification._aim_aware_config import AimAwareConfig
from tactful.classification._aim_aware_result import VERDICTS, AimAwareResult, ImpactVerdict, JointEvidence, Reason
from tactful.classification._features import FEATURES, Feature, measured
from tactful.classification._impact_cause import ImpactCause, ImpactCauses
from tactful.classification._impact_features import IMPACT_FEATURES, ImpactFeatures, impact_features
from tactful.classification._kinesthetic import KinestheticClassifier, KinestheticConfig
from tactful.classification._learned import LearnedClassifier, LearnedConfig
from tactful.classification._onset import Onset
from tactful.classification._verdict import Classifier, Evidence, Kind, Verdict

__all__ = [
    "CONTEXTS",
    "FEATURES",
    "IMPACT_FEATURES",
    "VERDICTS",
    "AdditiveModel",
    "AimAware",
    "AimAwareConfig",
    "AimAwareResult",
    "AimAwareTrace",
    "Classifier",
    "Evidence",
    "Feature",
    "ImpactCause",
    "ImpactCauses",
    "ImpactFeatures",
    "ImpactVerdict",
    "JointEvidence",
    "Kind",
    "KinestheticClassifier",
    "KinestheticConfig",
    "LearnedClassifier",
    "LearnedConfig",
    "ModelError",
    "Onset",
    "Reason",
    "Verdict",
    "impact_features",
    "measured",
]
