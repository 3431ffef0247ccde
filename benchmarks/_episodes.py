"""How fast the work cell is simulated."""

from __future__ import annotations

import time

from tactful.simulation import draw_plan, simulate

_SEED = 5


def measure_episodes(count: int) -> dict[str, float]:
    """Return by how much a processor is faster than the arm when it simulates episodes of the work cell.

    Counted is the time on the processor, controller, sensors and truth included, without that of other processes. An
    episode before that compiles the kernels.

    Args:
        count: number of episodes, of all kinds in turn.
    """
    plan = draw_plan(count + 1, _SEED, sensors="panda")
    simulate(plan[0])
    begin = time.process_time()
    robot_s = sum(simulate(spec).duration_s for spec in plan[1:])
    return {"ratio_real_time": robot_s / (time.process_time() - begin)}
