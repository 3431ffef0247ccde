"""Controllers, and the references that they follow."""

from tactful.control._cartesian_impedance import CartesianImpedance
from tactful.control._config import ImpedanceConfig
from tactful.control._impact_aware import ImpactControlConfig
from tactful.control._path import MinimumJerkPath, Pose, minimum_jerk
from tactful.control._reference_spreading import ReferenceSpreading
from tactful.control._rotation import orientation_error

__all__ = [
    "CartesianImpedance",
    "ImpactControlConfig",
    "ImpedanceConfig",
    "MinimumJerkPath",
    "Pose",
    "ReferenceSpreading",
    "minimum_jerk",
    "orientation_error",
]
