"""Settings of the Cartesian impedance controller."""

from __future__ import annotations

import math
from typing import Annotated

from pydantic import Field

from tactful.config import Config

PositiveFloat = Annotated[float, Field(gt=0)]
NonNegativeFloat = Annotated[float, Field(ge=0)]


class ImpedanceConfig(Config):
    """The impedance that the arm shows at its tip, see `CartesianImpedance`. The defaults are the paper's."""

    stiffness_n_m: NonNegativeFloat = 150.0
    """K of the three translations [N/m]."""
    stiffness_nm_rad: NonNegativeFloat = 10.0
    """K of the three rotations; it acts on sin(angle / 2), so 10 resists a small rotation with 5 [Nm/rad]."""
    damping_ns_m: NonNegativeFloat | None = None
    """B of the translations; None is 2 sqrt(K) [Ns/m]."""
    damping_nms_rad: NonNegativeFloat | None = None
    """B of the rotations; None is 2 sqrt(K) [Nms/rad]."""
    posture_stiffness_nm_rad: NonNegativeFloat = 10.0
    """Spring towards the posture, for motion that leaves the tip at rest [Nm/rad]. The paper does not say."""
    posture_damping_nms_rad: NonNegativeFloat = 3.0
    """Damping of that motion [Nms/rad]. The paper does not say."""
    gravity: bool = False
    """Whether g(q) is added, for an arm that does not compensate gravity itself."""
    period_s: PositiveFloat = 0.001
    """Time between two calls, h [s]."""
    torque_rate_nm_s: PositiveFloat | None = 1000.0
    """Largest rate of change of a joint's torque, 1000 as libfranka allows; None does not limit it [Nm/s]."""

    @property
    def damping(self) -> tuple[float, float]:
        """B of the translations [Ns/m] and of the rotations [Nms/rad] that are in force."""
        linear, angular = self.damping_ns_m, self.damping_nms_rad
        return (
            2 * math.sqrt(self.stiffness_n_m) if linear is None else linear,
            2 * math.sqrt(self.stiffness_nm_rad) if angular is None else angular,
        )
