"""A lesson: a cell in which an arm fails to insert its peg, and somebody who shows it how."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tactful.control import MinimumJerkPath, Pose
from tactful.dynamics import Dynamics
from tactful.monitor import ContactEvent, Monitor
from tactful.reaction import Plan, ReactionConfig, Reactor, Rule
from tactful.simulation._config import CellConfig, SensorConfig
from tactful.simulation._hands import Lead, Tremor
from tactful.simulation._operators import OPERATORS, Operator
from tactful.simulation._peg import PEG_LENGTH_M, mistaken, peg_arm
from tactful.simulation._scene import INSERTED_M, draw_scene
from tactful.simulation._spec import EpisodeSpec
from tactful.simulation._work_cell import WorkCell

Array = NDArray[np.float64]

TEACH = ReactionConfig(rules=(Rule(kind="cooperation", reaction="teach"),), guiding="translation", release_s=1.5)
"""As in the kinesthetic experiment, nothing is done about a collision; a cooperation lets go of the reference."""

_GRIP_M = 0.09
"""Where the peg is held: so far above its end [m], that it does not go into the hole."""
_ABOVE_M = 0.05
"""Height of the peg's end above the box on the way to the hole [m]."""
_AWAY_M = 0.03
"""How far the peg is first drawn out of its contact [m]."""
_DEPTH_M = 0.072
"""How deep the peg is led into the hole [m]."""
_LEADING_M_S = (0.06, 0.12)
"""Mean speed at which people lead [m/s], an assumption."""
_AIM_M = 0.001
"""Standard deviation of where they put the peg over the hole [m], an assumption."""
_LET_GO_S = 0.3
_REST_M = 0.001
_REST_S = 0.8
"""An arm that moved less than that in such a time stands still, as seen by a person."""
_AFTER_S = 1.0
_LONGEST_S = 40.0


@dataclass(frozen=True, kw_only=True)
class Execution:
    """One execution of a plan.

    Attributes:
        cell: the cell after it.
        reactor: what commanded the arm.
        events: the contacts as the monitor knew them last.
        inserted: whether the peg was in the hole at the end.
        stuck_s: when the operator found the arm at rest outside of the hole [s]; None if that did not happen.
        led_s: when the operator touched it, and let go [s].
    """

    cell: WorkCell
    reactor: Reactor
    events: tuple[ContactEvent, ...]
    inserted: bool
    stuck_s: float | None
    led_s: tuple[float, float] | None


class Lesson:
    """The cell of an episode, in which plans can be executed one after the other, with or without help.

    The arm is commanded by a `Reactor` and watched by a monitor: nothing that only the simulation knows gets to either.
    The operator is a person who sees the cell: when the arm has come to rest without having inserted the peg, he takes
    hold of it, leads it out of the contact, above the hole and down into it, once.

    Args:
        spec: the episode: its trajectory, sensors, arm and operator; everything is drawn from its seed.
    """

    def __init__(self, spec: EpisodeSpec) -> None:
        self.spec = spec
        self.robot = peg_arm()
        scene_rng, self._sensor_rng, self._hand_rng = np.random.default_rng(spec.seed).spawn(3)
        self.scene = draw_scene(spec, self.robot, scene_rng)
        self._dynamics = Dynamics(self.robot)

    @property
    def plan(self) -> Plan:
        """The reference that fails."""
        return self.scene.demonstration.pose

    @property
    def end_s(self) -> float:
        """How long it is [s]."""
        return float(self.scene.demonstration.end_s)

    def warm_up(self) -> None:
        """Compile what commands the arm, or load it compiled."""
        Reactor(self.robot, self.plan, posture=self.scene.q).warm_up()

    def execute(
        self,
        plan: Plan,
        end_s: float,
        monitor: Monitor,
        *,
        helped: bool,
        on_event: Callable[[float, ContactEvent], None] = lambda t, event: None,
    ) -> Execution:
        """Execute a plan to its end, or until the help is over.

        Args:
            plan: where the tip is to be.
            end_s: how long the plan is [s].
            monitor: a fresh monitor of the arm.
            helped: whether the operator helps when the arm is stuck.
            on_event: is told the time [s] of every event of the monitor, and the event, when it comes.
        """
        model_rng, constants_rng = np.random.default_rng(self.spec.arm).spawn(2)
        true = mistaken(self.robot, model_rng, scale=self.spec.mismatch) if self.spec.mismatch else self.robot
        cell = WorkCell(
            true,
            self.scene.fixtures,
            config=CellConfig(elastic=self.spec.elastic),
            sensors=SensorConfig.preset(self.spec.sensors),
            q=self.scene.q,
            rng=self._sensor_rng.spawn(1)[0],
            arm_rng=constants_rng,
        )
        config = TEACH.model_copy(update={"impedance": self.spec.impedance})
        reached_s = 0.0

        def followed(t: float) -> Pose:
            nonlocal reached_s
            reached_s = max(reached_s, t)
            return plan(t)

        reactor = Reactor(self.robot, followed, config, posture=self.scene.q)
        latest: dict[int, ContactEvent] = {}
        operator = _Helper(self, OPERATORS[self.spec.operator]) if helped and self.spec.operator else None
        rest = _Rest()
        stuck_s: float | None = None
        until_s = _LONGEST_S
        while cell.t < until_s:
            sample = cell.step(reactor.torque(cell.t, cell.q, cell.dq))
            event = monitor.update(*sample)
            if event is not None:
                latest[event.id] = event
                reactor.react(event, sample.t, sample.q)
                on_event(sample.t, event)
            if stuck_s is not None:
                continue
            if reached_s > end_s + _AFTER_S and (operator is None or self.inserted(cell)):
                break
            if operator is not None and rest.found(sample.t, self.tip(cell)) and not self.inserted(cell):
                stuck_s = sample.t
                cell.add_hand(operator.hand(stuck_s, self.tip(cell), self._hand_rng))
                until_s = operator.end_s + _AFTER_S
        reactor.halt(cell.q)
        return Execution(
            cell=cell,
            reactor=reactor,
            events=tuple(latest.values()),
            inserted=self.inserted(cell),
            stuck_s=stuck_s,
            led_s=None if stuck_s is None or operator is None else (operator.start_s, operator.end_s),
        )

    def tip(self, cell: WorkCell) -> Pose:
        """Return where the end of the peg truly is."""
        return Pose(*self._dynamics.pose(cell.q))

    def inserted(self, cell: WorkCell) -> bool:
        """Return whether the peg is in the hole."""
        tip, hole = self.tip(cell).position_m, self.scene.hole_m
        return bool(np.linalg.norm(tip[:2] - hole[:2]) < 0.01 and hole[2] - tip[2] >= INSERTED_M)


class _Rest:
    """Finds when a tip has come to rest after it moved."""

    def __init__(self) -> None:
        self._since = 0.0
        self._place: Array | None = None
        self._start: Array | None = None
        self._moved = False

    def found(self, t: float, tip: Pose) -> bool:
        """Return whether the tip rests since a while."""
        position_m = tip.position_m
        if self._start is None or self._place is None:
            self._start = self._place = position_m
        if not self._moved:
            self._moved = bool(np.abs(position_m - self._start).max() > 0.02)
        if np.abs(position_m - self._place).max() > _REST_M:
            self._place, self._since = position_m, t
        return self._moved and t - self._since >= _REST_S


class _Helper:
    """How an operator leads the peg into the hole."""

    def __init__(self, lesson: Lesson, operator: Operator) -> None:
        self._lesson = lesson
        self._operator = operator
        self.start_s = self.end_s = 0.0

    def hand(self, t: float, tip: Pose, rng: np.random.Generator) -> Lead:
        """Return the hand of an operator who sees the arm stuck at the time t [s]."""
        operator, hole = self._operator, self._lesson.scene.hole_m
        self.start_s = t + float(rng.uniform(*operator.reaction_s))
        rise_s = float(rng.uniform(*operator.rise_s))
        path = _path(tip, hole + _AIM_M * np.array([*rng.standard_normal(2), 0.0]), self.start_s + rise_s, rng)
        link = self._lesson.robot.frames[self._lesson.robot.tip].link
        flange = self._lesson.robot.frames["flange"]
        held = flange.rotation @ [0.0, 0.0, PEG_LENGTH_M - _GRIP_M] + flange.translation
        up = -(tip.rotation @ [0.0, 0.0, _GRIP_M])
        hand = Lead(
            link=self._lesson.robot.link_names[link],
            point_m=tuple(held.tolist()),
            start_s=self.start_s,
            rise_s=rise_s,
            hold_s=path.end_s - self.start_s - rise_s + _LET_GO_S,
            fall_s=float(rng.uniform(0.1, 0.3)),
            tremor=Tremor(
                amplitude_n=tuple((operator.tremor_n * rng.uniform(0.3, 1.0, 3)).tolist()),
                frequency_hz=tuple(rng.uniform(8.0, 12.0, 3).tolist()),
                phase_rad=tuple(rng.uniform(0.0, 2 * np.pi, 3).tolist()),
            ),
            path=lambda t: path.pose(t).position_m + up,
            stiffness_n_m=float(rng.uniform(*operator.stiffness_n_m)),
            strength_n=operator.force_n[1],
        )
        self.end_s = hand.end_s
        return hand


def _path(tip: Pose, hole_m: Array, start_s: float, rng: np.random.Generator) -> MinimumJerkPath:
    """Return the way out of the contact, above the hole and down into it."""
    outward = tip.position_m - hole_m
    outward[2] = 0.0
    beside = tip.position_m[2] < hole_m[2] - 0.005  # not on the box, but at its side
    away = _AWAY_M * outward / np.linalg.norm(outward) if beside else np.array([0.0, 0.0, _AWAY_M])
    above = hole_m[2] + _ABOVE_M
    free = tip.position_m + away
    points = [free, np.array([*free[:2], above]), np.array([*hole_m[:2], above]), hole_m - [0.0, 0.0, _DEPTH_M]]
    speed = float(rng.uniform(*_LEADING_M_S))
    t, stops = start_s, [(start_s, tip)]
    for number, point in enumerate(points):
        way_m = float(np.linalg.norm(point - stops[-1][1].position_m))
        if way_m < 1e-3:
            continue
        t += max(way_m / speed, 0.4)
        stops.append((t, Pose(tip.rotation, point)))
        if number == 2:
            t += float(rng.uniform(0.2, 0.6))  # a look whether it is above the hole
            stops.append((t, Pose(tip.rotation, point)))
    return MinimumJerkPath(stops)
