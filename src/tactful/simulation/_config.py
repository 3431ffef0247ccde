"""Settings of the work cell and its sensors."""

from __future__ import annotations

import math
from typing import Annotated, Literal, Self

from pydantic import Field

from tactful.config import Config

PositiveFloat = Annotated[float, Field(gt=0)]
NonNegativeFloat = Annotated[float, Field(ge=0)]


class CellConfig(Config):
    """How the work cell runs."""

    period_s: PositiveFloat = 0.001
    """Time between two samples, over which the commanded torque is held [s]."""
    substeps: Annotated[int, Field(ge=1)] = 2
    """Steps of the integration in one period."""
    rotor_inertia_kg_m2: NonNegativeFloat = 0.05
    """What every joint still feels of its rotor under torque control, where the torque is measured on the link's side
    [kg m^2]. An assumption: torque control makes a rotor feel lighter, and no manufacturer says how much. Without any,
    the damping of the paper's controller would make the light last link of some arms oscillate at 1 kHz."""
    elastic: bool = False
    """Whether the joints are elastic, with the stiffness that the arm's description tells. What is measured and
    controlled is the side of the link."""
    contact_time_s: PositiveFloat = 0.02
    """Time constant in which a penetration is pushed out; smaller is stiffer [s]."""
    contact_depth_m: PositiveFloat = 0.002
    """Penetration over which a contact grows to its full stiffness and damping, so that no force is a step [m]."""
    friction: NonNegativeFloat = 0.2
    """Coefficient of sliding friction of all contacts."""


class SensorConfig(Config):
    """What the sensors make of the truth. The defaults are a clean arm; measured arms are noisier."""

    encoder_step_rad: NonNegativeFloat = 2 * math.pi / 2**20
    """Resolution of the joint positions, 0 is exact [rad]."""
    velocity: Literal["exact", "difference"] = "exact"
    """Whether the velocity is the true one or the difference of the last two measured positions."""
    torque_noise_nm: NonNegativeFloat = 0.02
    """Standard deviation of the white noise of every torque [Nm]."""
    torque_offset_nm: NonNegativeFloat = 0.0
    """Standard deviation of the constant offsets of the torques, drawn once for an episode [Nm]."""

    @classmethod
    def preset(cls, name: str) -> Self:
        """Return sensors."""
        return cls.exact() if name == "exact" else cls()

    @classmethod
    def exact(cls) -> Self:
        """Return sensors that say the truth."""
        return cls(encoder_step_rad=0.0, torque_noise_nm=0.0)
