"""A planar arm with elastic joints that impacts a surface: the experiment of the aim-aware paper in simulation."""

from tactful.simulation.planar._arm import forward_kinematics, inverse_kinematics, planar_robot
from tactful.simulation.planar._config import ArmConfig, PlanarConfig, SensorsConfig, SurfaceConfig, TaskConfig
from tactful.simulation.planar._plan import plan_impact
from tactful.simulation.planar._simulate import PlanarImpact, Touch, simulate_impact, simulate_impacts

__all__ = [
    "ArmConfig",
    "PlanarConfig",
    "PlanarImpact",
    "SensorsConfig",
    "SurfaceConfig",
    "TaskConfig",
    "Touch",
    "forward_kinematics",
    "inverse_kinematics",
    "plan_impact",
    "planar_robot",
    "simulate_impact",
    "simulate_impacts",
]
