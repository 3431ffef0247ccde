"""A trial: an execution with help if it fails, and the next one without."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tactful.dynamics import Dynamics
from tactful.monitor import Monitor, MonitorConfig
from tactful.reaction import TeachingError, merge
from tactful.robots import Robot
from tactful.simulation import OPERATORS, EpisodeSpec, Execution, Lesson
from tactful.simulation._spec import SensorPreset, Trajectory

Array = NDArray[np.float64]

TRAJECTORIES: tuple[Trajectory, ...] = ("border", "side", "top")
_SPEEDS_M_S = (0.08, 0.14, 0.22)
_PICTURE_S = 0.05


@dataclass(frozen=True, kw_only=True)
class Trial:
    """What became of one seed.

    Attributes:
        trajectory: where the first reference led.
        operator: who helped.
        before: whether the peg was inserted without help.
        cooperation: whether the monitor told a cooperation while the hand was there; None where nobody helped.
        latency_s: from the touch to the first event of that kind [s].
        problem: why nothing was merged; None if it was.
        after: whether the next execution inserted the peg, without help.
        peak_n: largest force of the cell on the arm, in the first execution until the help and in the next [N].
        ways: positions of the tip every 50 ms, for a picture: `plan`, `first`, `next` [m], with the hole's place.
    """

    trajectory: str
    operator: str
    before: bool
    cooperation: bool | None
    latency_s: float | None
    problem: str | None
    after: bool
    peak_n: tuple[float, float | None]
    ways: dict[str, Any]

    def to_dict(self) -> dict[str, Any]:
        """Return plain data without the ways."""
        return {key: value for key, value in asdict(self).items() if key != "ways"}


def draw_trials(seeds: int, seed: int, sensors: SensorPreset) -> list[EpisodeSpec]:
    """Return the episodes of a study: trajectories, approaches, speeds and operators take turns.

    Args:
        seeds: how many.
        seed: what their seeds are drawn from.
        sensors: preset of the sensors.
    """
    rng = np.random.default_rng(seed)
    cases = list(product(OPERATORS, ("diagonal", "axis"), _SPEEDS_M_S))
    turns = {name: list[int]() for name in TRAJECTORIES}
    specs = []
    for k in range(seeds):
        trajectory = TRAJECTORIES[k % len(TRAJECTORIES)]
        turns[trajectory] = turns[trajectory] or rng.permutation(len(cases)).tolist()
        operator, approach, speed = cases[turns[trajectory].pop()]
        specs.append(
            EpisodeSpec(
                kind="collision_then_cooperation",
                seed=int(rng.integers(2**48)),
                trajectory=trajectory,
                approach=approach,
                speed_m_s=speed,
                operator=operator,
                place="peg",
                sensors=sensors,
            )
        )
    return specs


def trial(spec: EpisodeSpec, config: MonitorConfig) -> Trial:
    """Execute a reference that may fail, with help, merge what was shown, and execute the result without.

    Args:
        spec: the episode.
        config: the settings of the monitor, which watches both executions and tells the arm alone what to do.
    """
    lesson = Lesson(spec)
    first = lesson.execute(lesson.plan, lesson.end_s, Monitor(config=config), helped=True)
    plan, end_s, problem = lesson.plan, lesson.end_s, None
    if first.stuck_s is not None:
        try:
            merged = merge(plan, first.reactor.taught, lesson.robot, lesson.scene.q, impedance=spec.impedance)
            plan, end_s = merged.pose, merged.end_s
        except TeachingError as error:
            problem = str(error)
    again = lesson.execute(plan, end_s, Monitor(config=config), helped=False)
    told = [
        event.detected_s - first.led_s[0]
        for event in first.events
        if first.led_s and event.kind == "cooperation" and first.led_s[0] <= event.detected_s <= first.led_s[1]
    ]
    return Trial(
        trajectory=spec.trajectory,
        operator=spec.operator or "",
        before=first.stuck_s is None and first.inserted,
        cooperation=bool(told) if first.led_s else None,
        latency_s=min(told, default=None),
        problem=problem,
        after=again.inserted,
        peak_n=(_peak(first, first.stuck_s), _peak(again, None)),
        ways={
            "plan": [lesson.plan(t).position_m.tolist() for t in np.arange(0.0, lesson.end_s, _PICTURE_S)],
            "first": _way(first, lesson.robot),
            "next": _way(again, lesson.robot),
            "hole": lesson.scene.hole_m.tolist(),
            "led_s": first.led_s,
        },
    )


def _peak(execution: Execution, until_s: float | None) -> float:
    contacts = [
        c for c in execution.cell.contacts if c.kind == "collision" and (until_s is None or c.touch_s < until_s)
    ]
    return max((c.peak_force_n for c in contacts), default=0.0)


def _way(execution: Execution, robot: Robot) -> list[list[float]]:
    q = execution.cell.recording().q
    assert q is not None
    dynamics = Dynamics(robot)
    step = round(_PICTURE_S / execution.cell.config.period_s)
    return [dynamics.pose(row)[1].tolist() for row in q[::step]]
