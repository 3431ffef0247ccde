"""Settings of the bench: tool, task, contact, sensors and what differs from the plan."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field, NonNegativeFloat, NonNegativeInt, PositiveFloat

from tactful.config import Config
from tactful.control import ImpactControlConfig
from tactful.detection import ImpactConfig
from tactful.simulation._config import CellConfig, SensorConfig

_INF = float("inf")


class FlatToolConfig(Config):
    """A flat plate on the flange, square to it, that touches with four round feet. The figures are assumed."""

    length_m: PositiveFloat = 0.10
    """From the flange to the face [m]."""
    half_length_m: PositiveFloat = 0.10
    """Half the distance of the feet along the approach, across the axis of the inclination [m]."""
    half_width_m: PositiveFloat = 0.04
    """Half the distance of the feet along that axis [m]."""
    foot_radius_m: PositiveFloat = 0.004
    """Radius of the feet, whose lowest points make the face [m]."""
    mass_kg: PositiveFloat = 0.5
    """[kg]"""


class BenchTaskConfig(Config):
    """What the arm is to do, and what its planner believes; speed and times are assumed."""

    speed_m_s: PositiveFloat = 0.3
    """Speed of the face at the impact [m/s]."""
    impact_s: PositiveFloat = 0.7
    """t_d, desired time of the impact after the start [s]."""
    end_s: PositiveFloat = 1.2
    """t_f, end of the post-impact reference [s]."""
    x_m: float = 0.51
    """x_imp, where the impact is planned [m]."""
    height_m: float = 0.15
    """z of the platform there, above the base [m]."""
    friction: NonNegativeFloat = 0.0
    """Coefficient of friction that the impact map assumes."""
    restitution: Annotated[float, Field(ge=0, le=1)] = 0.0
    """Coefficient of restitution that the impact map assumes."""


class BenchConfig(Config):
    """The bench, whole. Angle, place and inclination are the paper's; everything else is assumed."""

    robot: str = "panda"
    """Name or file of the arm; it needs the stiffness of its joints."""
    tool: FlatToolConfig = FlatToolConfig()
    task: BenchTaskConfig = BenchTaskConfig()
    cell: CellConfig = CellConfig(
        elastic=True,
        substeps=5,
        contact_time_s=0.004,
        contact_depth_m=0.0005,
        friction=0.3,
    )
    """Joints, motors and contact: an inelastic one, as of a tool in cloth."""
    sensors: SensorConfig = SensorConfig.preset("panda")
    """By default what was measured on a Panda: encoder steps, noise and its spectrum, ripple, friction, offsets."""
    control: ImpactControlConfig = ImpactControlConfig()
    """Gains as those of the planar arm."""
    observer_gain: PositiveFloat = 50.0
    """K_O of the momentum observer [1/s]."""
    impact: ImpactConfig = ImpactConfig(r_b_nm_s=(_INF, 4000.0, _INF, 3000.0, _INF, _INF, _INF))
    """When the controller switches."""
    model_error: NonNegativeFloat = 1.0
    """Scale of the errors of the arm's model: masses 2 %, centres of mass 2 mm, inertias 5 %, 30 g at the tool."""
    arm_seed: NonNegativeInt = 0
    """Which arm it is: what its model errors, offsets and ripple are drawn from."""
    height_sd_m: NonNegativeFloat = 0.0005
    """By how much the height of the platform differs from run to run, as a standard deviation [m]."""
    inclination_sd_deg: NonNegativeFloat = 0.1
    """The same of its inclination [deg]."""
    duration_s: PositiveFloat = 0.95
    """[s]"""
