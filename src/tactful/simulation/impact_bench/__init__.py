"""Any serial arm with a flat tool that impacts a platform, in MuJoCo: the experiment of the aim-aware paper.

Needs the extra `mujoco`.
"""

from tactful.simulation.impact_bench._arm import flat_tool
from tactful.simulation.impact_bench._config import BenchConfig, BenchTaskConfig, FlatToolConfig
from tactful.simulation.impact_bench._plan import BenchPlan, plan_strike
from tactful.simulation.impact_bench._strike import Strike, strike

__all__ = [
    "BenchConfig",
    "BenchPlan",
    "BenchTaskConfig",
    "FlatToolConfig",
    "Strike",
    "flat_tool",
    "plan_strike",
    "strike",
]
