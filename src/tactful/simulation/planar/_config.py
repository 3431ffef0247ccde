"""Settings of the planar arm, its task and its sensors."""

from __future__ import annotations

import math
from typing import Annotated, Literal, Self

import numpy as np
from pydantic import Field, NonNegativeFloat, PositiveFloat, model_validator

from tactful.config import Config
from tactful.control import ImpactControlConfig
from tactful.detection import ImpactConfig
from tactful.impacts import CompliantContactConfig

Three = tuple[PositiveFloat, PositiveFloat, PositiveFloat]
ThreeOrZero = tuple[NonNegativeFloat, NonNegativeFloat, NonNegativeFloat]


class ArmConfig(Config):
    """A planar arm of three elastic joints in a vertical plane; links are uniform rods. The figures are assumed."""

    length_m: Three = (0.327, 0.393, 0.22)
    """Lengths of the links [m]."""
    mass_kg: Three = (3.88, 4.82, 3.10)
    """Masses of the links [kg]."""
    rotor_inertia_kg_m2: Three = (3.0, 2.0, 0.4)
    """B, inertia of the motors behind the gear [kg m^2]."""
    shaping: Annotated[float, Field(ge=1)] = 4.0
    """How much smaller the torque loop makes the motors feel: B_theta = B / shaping."""
    stiffness_nm_rad: Three = (12000.0, 12000.0, 5000.0)
    """K of the joints [Nm/rad]."""
    damping_nms_rad: ThreeOrZero = (15.0, 12.0, 4.0)
    """D of the joints [Nms/rad]."""
    coulomb_nm: ThreeOrZero = (0.0, 0.0, 0.0)
    """Coulomb friction of the motors that is left after its compensation, as the torque loop lets it through [Nm]."""
    viscous_nms: ThreeOrZero = (0.0, 0.0, 0.0)
    """Viscous friction of the motors that is left after its compensation [Nms/rad]."""
    tip: Literal["flat", "ball"] = "flat"
    """A flat end effector touches with its two edges, a ball with one point."""
    half_width_m: PositiveFloat = 0.10
    """Half the width of the flat end effector [m]."""
    gravity_m_s2: NonNegativeFloat = 9.81
    """Against y [m/s^2]."""

    @property
    def motor_inertia(self) -> tuple[float, ...]:
        """B_theta, what the torque loop leaves of the motors' inertia [kg m^2]."""
        return tuple(B / self.shaping for B in self.rotor_inertia_kg_m2)

    @property
    def offsets_m(self) -> tuple[float, ...]:
        """Where along the face of the tip the contact points lie [m]."""
        return (-self.half_width_m, self.half_width_m) if self.tip == "flat" else (0.0,)


class TaskConfig(Config):
    """What the arm is to do, and what its planner believes. The figures are assumed."""

    speed_m_s: PositiveFloat = 0.3
    """Speed of the tip at the impact [m/s]."""
    impact_s: PositiveFloat = 0.5
    """t_d, desired time of the impact after the start [s]."""
    end_s: PositiveFloat = 1.0
    """t_f, end of the post-impact reference [s]."""
    height_m: float = -0.05
    """y of the surface where the impact is planned, above the shoulder [m]."""
    surface_offset_m: float = 0.0
    """How much higher the surface is than the planner believes [m]."""
    elbow: Literal["up", "down"] = "up"
    """Which of the two inverse kinematics is taken."""
    friction: NonNegativeFloat = 0.0
    """Coefficient of friction that the impact map assumes."""
    restitution: Annotated[float, Field(ge=0, le=1)] = 0.0
    """Coefficient of restitution that the impact map assumes."""
    object_mass_kg: PositiveFloat | None = None
    """Mass of the object that the impact map assumes, free to give way along the normal; None is a fixed surface."""


class SurfaceConfig(Config):
    """The surface that is struck, where it is not a fixed plane without end."""

    begin_m: float | None = None
    """Where it begins, along it from the place of the planned impact; None is without end. A flat tool that reaches
    beyond comes to lie on the edge [m]."""
    end_m: float | None = None
    """Where it ends [m]."""
    mass_kg: PositiveFloat | None = None
    """Mass of the object whose face it is and which gives way along the normal, at rest before; None is fixed [kg]."""
    support_n_m: NonNegativeFloat = 0.0
    """Stiffness of what the object rests on [N/m]."""
    support_ns_m: NonNegativeFloat = 0.0
    """Damping of what the object rests on [Ns/m]."""

    @model_validator(mode="after")
    def _check(self) -> Self:
        begin, end = self.reach_m
        if not begin < end:
            raise ValueError(f"reaches from {begin:g} to {end:g} m: it has to end after it begins")
        return self

    @property
    def reach_m(self) -> tuple[float, float]:
        """Where it begins and ends [m]."""
        return (
            -math.inf if self.begin_m is None else self.begin_m,
            math.inf if self.end_m is None else self.end_m,
        )


class SensorsConfig(Config):
    """What the sensors make of the truth, for the controller and for the monitor."""

    encoder_noise_rad: NonNegativeFloat = 0.0
    """Standard deviation of the joint positions [rad]."""
    torque_noise_nm: NonNegativeFloat = 0.0
    """Standard deviation of the joint torques [Nm]."""
    velocity_cutoff_hz: PositiveFloat | None = None
    """None measures the velocity itself; else it is the difference of positions behind a first-order low-pass [Hz]."""


class PlanarConfig(Config):
    """A planar impact, whole. The paper gives neither robot nor controller nor r_b: all figures are assumed."""

    arm: ArmConfig = ArmConfig()
    task: TaskConfig = TaskConfig()
    surface: SurfaceConfig = SurfaceConfig()
    contact: CompliantContactConfig = CompliantContactConfig()
    control: ImpactControlConfig = ImpactControlConfig()
    sensors: SensorsConfig = SensorsConfig()
    observer_gain: PositiveFloat = 50.0
    """K_O of the momentum observer [1/s]."""
    impact: ImpactConfig = ImpactConfig(r_b_nm_s=(1500.0, 1500.0, float("inf")))
    """When the controller switches; K_O and r_b decide it together."""
    period_s: PositiveFloat = 0.001
    """Time between two samples, over which the torque is held [s]."""
    duration_s: PositiveFloat = 0.85
    """[s]"""
    step_s: PositiveFloat = 5e-4
    """Largest step of the integration out of contact [s]."""
    contact_step_s: PositiveFloat = 1e-4
    """Largest step of the integration in contact; stiffer or more damped contacts take smaller ones [s]."""

    @property
    def samples(self) -> int:
        """Number of samples of a run."""
        return 1 + int(np.floor(self.duration_s / self.period_s + 1e-9))
