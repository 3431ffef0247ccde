"""From the spec of an episode to its recording."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from tactful.control import CartesianImpedance
from tactful.dynamics import Dynamics
from tactful.errors import TactfulError
from tactful.recordings import Recording
from tactful.robots import Robot
from tactful.simulation._config import CellConfig, SensorConfig
from tactful.simulation._hands import Guide, Push
from tactful.simulation._operators import OPERATORS, Operator
from tactful.simulation._peg import mistaken, peg_arm
from tactful.simulation._scene import INSERTED_M, Scene, draw_scene
from tactful.simulation._shape import Shape
from tactful.simulation._spec import PLACES, EpisodeSpec
from tactful.simulation._truth import TrueContact
from tactful.simulation._work_cell import WorkCell

Array = NDArray[np.float64]

_ATTEMPTS = 12
_AFTER_S = 0.8
"""How long an episode goes on after the last movement and the last touch [s]."""
_LOOK_EVERY = 10
_LEAST_LEVER_M = 0.12
"""People push where it moves the arm: |tau_ext| / |F| is at least this [m]."""
NOTE = "episode "
"""How the note of a recording begins that holds its spec as JSON."""


@dataclass(frozen=True)
class EpisodeResult:
    """What an episode was.

    Attributes:
        recording: what the sensors said, with the true labels.
        contacts: what touched the arm, weak touches too.
        inserted: whether the peg was in the hole at the end.
    """

    recording: Recording
    contacts: tuple[TrueContact, ...]
    inserted: bool


def simulate(spec: EpisodeSpec) -> Recording:
    """Return the recording of an episode, with the true contacts as labels; the same spec gives the same, bit for bit.

    What does not come out as the kind of the spec says is drawn again, from the same seed. A note of the recording
    holds the spec, see `spec_of`.

    Raises:
        TactfulError: if MuJoCo is not installed, or no attempt gives what the spec asks for.
    """
    return run_episode(spec).recording


def run_episode(spec: EpisodeSpec) -> EpisodeResult:
    """Return the recording of an episode together with what only a simulation knows, see `simulate`."""
    helped = "cooperation" in spec.kind
    if helped and (spec.operator not in OPERATORS or spec.place not in PLACES):
        raise TactfulError(
            f"episode of {spec.kind}: operator is {spec.operator!r} and place {spec.place!r}, but they have to be of "
            f"{', '.join(OPERATORS)} and of {', '.join(PLACES)}"
        )
    for attempt in range(_ATTEMPTS):
        rng = np.random.default_rng((spec.seed, attempt))
        result = _attempt(spec, rng)
        if result is not None:
            return result
    raise TactfulError(f"episode {spec.name}: {_ATTEMPTS} attempts gave no {spec.kind}; choose another seed")


def spec_of(recording: Recording) -> EpisodeSpec | None:
    """Return the spec that a recording was simulated from, or None where it was not."""
    for note in recording.notes:
        if note.startswith(NOTE):
            return EpisodeSpec.model_validate_json(note.removeprefix(NOTE))
    return None


def _attempt(spec: EpisodeSpec, rng: np.random.Generator) -> EpisodeResult | None:
    robot = peg_arm()
    scene_rng, sensor_rng, hand_rng = rng.spawn(3)
    model_rng, constants_rng = np.random.default_rng(spec.arm).spawn(2)
    scene = draw_scene(spec, robot, scene_rng)
    cell = WorkCell(
        _true_arm(robot, spec, model_rng),
        scene.fixtures,
        config=CellConfig(elastic=spec.elastic),
        sensors=SensorConfig.preset(spec.sensors),
        q=scene.q,
        rng=sensor_rng,
        arm_rng=constants_rng,
    )
    controller = CartesianImpedance(robot, spec.impedance, posture=scene.q)
    help_ = _Help(spec, scene, robot, hand_rng) if spec.operator else None
    end_s = scene.demonstration.end_s + _AFTER_S
    step = 0
    while cell.t < end_s:
        if step % _LOOK_EVERY == 0:
            seen = cell.contacts_so_far
            if spec.kind in ("free", "cooperation") and "collision" in seen:
                return None
            if spec.kind == "cooperation_then_collision" and seen == ("collision",):
                return None
            if help_ is not None and help_.hand is None:
                hand = help_.begin(cell, collided="collision" in seen)
                if hand is not None:
                    cell.add_hand(hand)
                    end_s = max(end_s, hand.end_s + _AFTER_S)
        cell.step(controller.torque(cell.q, cell.dq, *scene.demonstration.pose(cell.t)))
        step += 1
    contacts = cell.contacts
    if not _as_named(spec, contacts):
        return None
    recording = replace(cell.recording(), notes=(NOTE + spec.model_dump_json(),))
    q = recording.q
    if q is None or np.any((q < robot.lower) | (q > robot.upper)):  # its own stops touched it, and no label says so
        return None
    tip = Dynamics(robot).pose(cell.q)[1]
    near = np.linalg.norm(tip[:2] - scene.hole_m[:2]) < 0.01
    return EpisodeResult(recording, contacts, bool(near and scene.hole_m[2] - tip[2] >= INSERTED_M))


def _true_arm(robot: Robot, spec: EpisodeSpec, rng: np.random.Generator) -> Robot:
    true = mistaken(robot, rng, scale=spec.mismatch) if spec.mismatch else robot
    if not spec.payload_error_kg:
        return true
    mass = true.mass.copy()
    mass[robot.frames[robot.tip].link] += spec.payload_error_kg
    return replace(true, mass=mass)


def _as_named(spec: EpisodeSpec, contacts: tuple[TrueContact, ...]) -> bool:
    """Whether the contacts are those that the kind names; those below 1 N do not count, but free means none at all."""
    if spec.kind == "free":
        return not contacts
    kinds: list[Literal["collision", "cooperation"]] = [c.kind for c in contacts if c.visible_s is not None]
    if spec.kind in ("collision", "cooperation"):
        return bool(kinds) and set(kinds) == {spec.kind}
    first, _, second = spec.kind.partition("_then_")
    return bool(kinds) and kinds[0] == first and second in kinds


class _Help:
    """When and how the operator of an episode touches the arm."""

    def __init__(self, spec: EpisodeSpec, scene: Scene, robot: Robot, rng: np.random.Generator) -> None:
        assert spec.operator is not None
        assert spec.place is not None
        self._operator: Operator = OPERATORS[spec.operator]
        self._place = spec.place
        self._scene = scene
        self._robot = robot
        self._dynamics = Dynamics(robot)
        self._shape = Shape(robot)
        self._rng = rng
        self._after_collision = spec.kind == "collision_then_cooperation"
        path = scene.demonstration
        latest = {"cooperation_then_collision": 0.45 * scene.free_s}.get(spec.kind, 0.75 * path.end_s)
        self._start_s = None if self._after_collision else float(rng.uniform(0.6, max(0.7, latest)))
        self.hand: Push | Guide | None = None

    def begin(self, cell: WorkCell, *, collided: bool) -> Push | Guide | None:
        """Return the hand as soon as it is time for it."""
        if self._after_collision and self._start_s is None and collided:
            self._start_s = cell.t + float(self._rng.uniform(*self._operator.reaction_s))
        if self._start_s is None or cell.t < self._start_s:
            return None
        self.hand = self._touch(cell)
        return self.hand

    def _touch(self, cell: WorkCell) -> Push | Guide:
        rng, q = self._rng, cell.q
        link, parts = _parts(self._robot, self._shape, self._place)
        R, origin = self._shape.link_pose(q, link)
        start, end, radius = self._shape.at(q)
        for _ in range(50):
            part = rng.choice(parts)
            axis = start[part] + rng.uniform() * (end[part] - start[part])
            direction = self._direction(q, cell.dq, link, axis)
            outward = rng.standard_normal(3) - 2.0 * direction  # most people push, some pull
            along = end[part] - start[part]
            if along @ along > 1e-6:
                outward -= (outward @ along) / (along @ along) * along
            point = axis + radius[part] * outward / np.linalg.norm(outward)
            lever = self._dynamics.jacobian_at(q, link, point)[:3].T @ direction
            if np.linalg.norm(lever) > _LEAST_LEVER_M:
                break
        name = self._robot.link_names[link]
        return self._operator.hand(name, R.T @ (point - origin), point, direction, cell.t, rng)

    def _direction(self, q: Array, dq: Array, link: int, point: Array) -> Array:
        if self._after_collision:
            return self._operator.direction(self._scene.remedy, self._rng)
        velocity = self._dynamics.jacobian_at(q, link, point)[:3] @ dq
        speed = float(np.linalg.norm(velocity))
        if speed < 0.01:
            velocity, speed = self._rng.standard_normal(3), 1.0
            velocity /= np.linalg.norm(velocity)
        return self._operator.across(velocity / speed, np.array([0.0, 0.0, 1.0]), self._rng)


def _parts(robot: Robot, shape: Shape, place: str) -> tuple[int, Array]:
    """Return the link of a place and the capsules that it consists of."""
    peg = len(shape.link) - 1
    if place == "peg":
        return int(shape.link[peg]), np.array([peg])
    link = robot.link_names.index(place)
    parts = np.flatnonzero(shape.link == link)
    return link, parts[parts != peg]
