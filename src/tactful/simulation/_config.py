"""Settings of the work cell and its sensors."""

from __future__ import annotations

import math
import tomllib
from importlib import resources
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from tactful.config import Config
from tactful.errors import TactfulError

PositiveFloat = Annotated[float, Field(gt=0)]
NonNegativeFloat = Annotated[float, Field(ge=0)]
PerJoint = NonNegativeFloat | tuple[NonNegativeFloat, ...]
PRESETS = ("exact", "clean", "panda")


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


class NoiseSpectrum(Config):
    """How the noise of one joint's velocity x_1 and torque x_2, both of unit variance, follows from its past.

    x(k) = sum_l A_l x(k - l) + L e(k) with white noise e of unit variance: both spectra, and how they hang together.
    """

    lags: tuple[tuple[float, float, float, float], ...]
    """A_1, A_2, ..., each by rows; a stable recursion."""
    innovation: tuple[float, float, float]
    """L by rows, without the zero above its diagonal."""


class SensorConfig(Config):
    """What the sensors make of the truth. The defaults are those of a clean arm without ripple, friction and offset.

    A figure is one for all joints, or a tuple with one a joint. Noise is that of samples at 1 kHz.
    """

    encoder_step_rad: NonNegativeFloat = 2 * math.pi / 2**20
    """Resolution of the joint positions, 0 is exact [rad]."""
    velocity: Literal["exact", "difference"] = "exact"
    """Whether the velocity is the true one or the difference of the last two measured positions."""
    velocity_cutoff_hz: PositiveFloat | None = None
    """Bandwidth of the first-order low-pass behind the velocity; None is none [Hz]."""
    velocity_noise_rad_s: PerJoint = 0.0
    """Standard deviation of the velocity's noise at rest [rad/s]."""
    velocity_noise_growth: PerJoint = 0.0
    """By how much it grows with the speed of the joint [rad/s over rad/s]."""
    torque_noise_nm: PerJoint = 0.02
    """Standard deviation of the torque's noise at rest [Nm]."""
    torque_noise_growth: PerJoint = 0.0
    """By how much it grows with the speed of the joint [Nm over rad/s]."""
    spectrum: tuple[NoiseSpectrum, ...] = ()
    """Spectra of both noises, one a joint; without, both are white and independent."""
    ripple_nm: tuple[PerJoint, ...] = ()
    """Amplitudes of the gear's torque ripple, one for each harmonic [Nm]."""
    ripple_per_turn: tuple[PerJoint, ...] = ()
    """Periods of each harmonic in one turn of the joint; its phase is drawn once for an arm."""
    coulomb_nm: PerJoint = 0.0
    """Dry friction that the torque still contains: c tanh(dq / 0.02 rad/s) is added [Nm]."""
    hysteresis_rad: PerJoint = 0.0
    """Displacement over which that friction is taken up after a reversal, as `ObserverConfig.hysteresis_rad` [rad]."""
    torque_offset_nm: PerJoint = 0.0
    """Standard deviation of the constant offsets of the torques, drawn once for an arm [Nm]."""
    stamp_jitter_s: NonNegativeFloat = 0.0
    """Standard deviation of the time stamps about the instants of the samples; they never run backwards [s]."""
    repeated_rows: Annotated[float, Field(ge=0, lt=1)] = 0.0
    """Share of the rows that repeat the one before, because the robot's next one came too late; time goes on."""
    provenance: str = ""
    """Where the figures come from; nothing depends on it."""

    @model_validator(mode="after")
    def _check(self) -> Self:
        if len(self.ripple_nm) != len(self.ripple_per_turn):
            raise ValueError("ripple_nm and ripple_per_turn need one entry for each harmonic, both")
        return self

    @classmethod
    def exact(cls) -> Self:
        """Return sensors that say the truth."""
        return cls(encoder_step_rad=0.0, torque_noise_nm=0.0)

    @classmethod
    def preset(cls, name: str) -> Self:
        """Return sensors by name: `exact`, `clean` or `panda`.

        `clean` is a good arm, assumed; `panda` has the noise, ripple, friction, offset and time stamps that were
        measured on a Panda of Franka Emika in free motion, see its `provenance`.

        Raises:
            TactfulError: there is no such preset.
        """
        if name == "exact":
            return cls.exact()
        file = resources.files("tactful.simulation") / "presets" / f"{name}.toml"
        if name not in PRESETS or not file.is_file():
            raise TactfulError(f"there are no sensors {name!r}: choose from {', '.join(PRESETS)}")
        return cls(**tomllib.loads(file.read_text(encoding="utf-8")))
