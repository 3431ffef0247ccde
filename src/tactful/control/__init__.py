"""Controllers, and the references that they follow."""

from tactful.control._cartesian_impedance import CartesianImpedance
from tactful.control._config import ImpedanceConfig
from tactful.control._follow import FOLLOW_STEP_S, follow, reach
from tactful.control._impact_aware import ImpactControlConfig
from tactful.control._impact_aware_arm import ImpactAwareController
from tactful.control._movement_primitive import MovementPrimitive
from tactful.control._path import MinimumJerkPath, Pose, minimum_jerk
from tactful.control._reference_spreading import ReferenceSpreading
from tactful.control._rotation import orientation_error

__all__ = [
    "FOLLOW_STEP_S",
    "CartesianImpedance",
    "ImpactAwareController",
    "ImpactControlConfig",
    "ImpedanceConfig",
    "MinimumJerkPath",
    "MovementPrimitive",
    "Pose",
    "ReferenceSpreading",
    "follow",
    "minimum_jerk",
    "orientation_error",
    "reach",
]
