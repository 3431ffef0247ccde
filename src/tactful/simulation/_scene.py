"""What an episode takes place in, drawn from its spec."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tactful.control import FOLLOW_STEP_S, Pose, follow, reach
from tactful.dynamics import Dynamics
from tactful.errors import TactfulError
from tactful.robots import Robot
from tactful.simulation._demonstration import Demonstration
from tactful.simulation._fixtures import Bar, Fixture, HoledBox
from tactful.simulation._peg import PEG_RADIUS_M
from tactful.simulation._shape import Shape, capsule_gap
from tactful.simulation._spec import EpisodeSpec

Array = NDArray[np.float64]

BOX_HEIGHT_M = 0.14
INSERTED_M = 0.05
"""How deep the peg has to be in the hole for the insertion to have succeeded [m]."""
_DEPTH_M = 0.065
"""How deep the reference leads into the hole [m]."""
BOX_HALF_M = 0.08
_INSERTION_M_S = 0.06
_FREE_ABOVE_M = 0.30
"""Height of the tip over the table from which hands may push it about without bringing it to the box [m]."""
_TRIES = 60
_LINKS_IN_THE_WAY = (2, 3, 4, 5, 6)
"""Indices of the links that may meet a bar; those before hardly move."""
_NEAR_S, _NEAR_M = 0.2, 0.004
"""Until so long before the contact nothing comes nearer to the bar than that."""
_LEAST_SPEED_M_S = 0.03
"""Of a link that meets a bar [m/s]."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Scene:
    """A cell's contents and what is to happen there.

    Attributes:
        q: joint positions at the start (n,) [rad].
        fixtures: what stands in the cell.
        demonstration: the reference.
        hole_m: middle of the hole's upper edge (3,) [m].
        free_s: until when nothing is met, as far as can be told [s].
        remedy: direction in which a force helps after the collision (3,).
    """

    q: Array
    fixtures: tuple[Fixture, ...]
    demonstration: Demonstration
    hole_m: Array
    free_s: float
    remedy: Array


def draw_scene(spec: EpisodeSpec, robot: Robot, rng: np.random.Generator) -> Scene:
    """Draw the box, the initial pose, the demonstration and, where the spec asks for one, a bar in the way.

    Raises:
        TactfulError: if nothing possible is drawn in many attempts.
    """
    for _ in range(_TRIES):
        hole = np.array([0.50 + rng.uniform(-0.03, 0.03), rng.uniform(-0.03, 0.03), BOX_HEIGHT_M])
        points, speeds, remedy = _points(spec, hole, rng)
        rotations = _rotations(robot, rng)
        try:
            q = reach(robot, Pose(rotations[0], points[0]), robot.home)
        except TactfulError:
            continue
        wobble = 0.0005 if spec.trajectory in ("ideal", "border") else 0.002
        path = Demonstration(points, speeds, rotations, rng, wobble_m=wobble)
        fixtures: list[Fixture] = [
            HoledBox(centre_m=(hole[0], hole[1]), hole_m=2 * (PEG_RADIUS_M + spec.clearance_m), depth_m=0.09)
        ]
        free_s = path.legs[-1][0]
        if spec.trajectory == "obstacle":
            track = follow(robot, path.pose, q, path.end_s, spec.impedance)
            found = _bar(robot, track, spec, rng)
            if found is None:
                continue
            bar, free_s, remedy = found
            fixtures.append(bar)
        return Scene(q=q, fixtures=tuple(fixtures), demonstration=path, hole_m=hole, free_s=free_s, remedy=remedy)
    raise TactfulError(f"episode {spec.name}: no possible scene in {_TRIES} attempts; choose another seed")


def _points(spec: EpisodeSpec, hole: Array, rng: np.random.Generator) -> tuple[Array, list[float], Array]:
    """Return the points of the reference (k, 3) [m], the speeds between them [m/s], and what remedies a collision."""
    speed = spec.speed_m_s
    if spec.trajectory in ("free", "obstacle"):
        legs = 3 if spec.kind in ("free", "cooperation_then_collision") else 2
        points = [_free_point(hole, rng)]
        while len(points) <= legs:
            nearer = _free_point(hole, rng)
            if 0.15 < np.linalg.norm(nearer - points[-1]) < 0.5:
                points.append(nearer)
        points, speeds = _routed(points, [speed] * legs, spec, rng)
        return np.array(points), speeds, np.array([0.0, 0.0, 1.0])
    azimuth = rng.uniform(0, 2 * np.pi)
    outward = np.array([np.cos(azimuth), np.sin(azimuth), 0.0])
    start = hole + rng.uniform(0.12, 0.26) * outward + _up(rng.uniform(0.12, 0.26))
    ahead = [] if spec.kind != "cooperation_then_collision" else [_free_point(hole, rng)]
    if spec.trajectory == "side":
        depth = rng.uniform(0.04, 0.09)
        side = outward * (BOX_HALF_M + PEG_RADIUS_M + rng.uniform(0.07, 0.12)) / np.abs(outward[:2]).max()
        low = hole + side - _up(depth)
        high = low + _up(rng.uniform(0.10, 0.16))
        into = hole - _up(depth + rng.uniform(-0.01, 0.01))
        points, speeds = _routed([*ahead, high, low], [speed] * (1 + len(ahead)), spec, rng)
        lifted = 0.5 * outward + _up(1.0)
        return np.array([*points, into]), [*speeds, speed], lifted / np.linalg.norm(lifted)
    offset_m = {"ideal": abs(0.0015 * rng.standard_normal()), "border": rng.uniform(0.004, 0.011)}
    about = rng.uniform(0, 2 * np.pi)
    aside = np.array([np.cos(about), np.sin(about), 0.0])
    target = hole + offset_m.get(spec.trajectory, rng.uniform(0.028, 0.055)) * aside
    above, bottom = target + _up(0.04), target - _up(_DEPTH_M)
    remedy = _up(0.4 if spec.trajectory == "top" else 0.0) - aside
    remedy /= np.linalg.norm(remedy)
    if spec.trajectory == "top" and spec.approach == "diagonal":
        into = bottom + _up(rng.uniform(0.0, 0.04))
        return np.array([*ahead, start, into]), [speed] * (1 + len(ahead)), remedy
    points, speeds = _routed([*ahead, start, above], [speed] * (1 + len(ahead)), spec, rng)
    into_speed = speed if spec.trajectory == "top" else min(speed, _INSERTION_M_S)
    return np.array([*points, bottom]), [*speeds, into_speed], remedy


def _up(height_m: float) -> Array:
    return np.array([0.0, 0.0, height_m])


def _free_point(hole: Array, rng: np.random.Generator) -> Array:
    return np.array([rng.uniform(0.32, 0.60), hole[1] + rng.uniform(-0.3, 0.3), rng.uniform(_FREE_ABOVE_M, 0.5)])


def _routed(
    points: list[Array], speeds: list[float], spec: EpisodeSpec, rng: np.random.Generator
) -> tuple[list[Array], list[float]]:
    """Return points and speeds as they are, or with every way along one axis after the other, downwards last."""
    if spec.approach == "diagonal":
        return points, speeds
    routed, faster = [points[0]], list[float]()
    for point, speed in zip(points[1:], speeds, strict=True):
        order = [*rng.permutation(2), 2] if point[2] < routed[-1][2] else [2, *rng.permutation(2)]
        for axis in order:
            if abs(point[axis] - routed[-1][axis]) > 0.02:
                corner = routed[-1].copy()
                corner[axis] = point[axis]
                routed.append(corner)
                faster.append(speed)
        if np.any(routed[-1] != point):  # the rest, which is short
            routed.append(point)
            faster.append(speed)
    return routed, faster


def _rotations(robot: Robot, rng: np.random.Generator) -> Array:
    """Return the orientation at the start and at the end (2, 3, 3): the peg downwards, turned and at first tilted."""
    from scipy.spatial.transform import Rotation

    rotation = Dynamics(robot).pose(robot.home)[0]
    yaw = rng.uniform(-0.5, 0.5)
    start, end = (
        Rotation.from_rotvec([*(tilt * rng.standard_normal(2)), yaw + turn]).as_matrix() @ rotation
        for tilt, turn in ((0.05, rng.uniform(-0.2, 0.2)), (0.005, 0.0))
    )
    return np.array([start, end])


def _bar(robot: Robot, track: Array, spec: EpisodeSpec, rng: np.random.Generator) -> tuple[Bar, float, Array] | None:
    """Return a bar that a link, not the peg, will meet while it moves, when, and what remedies it; or None."""
    shape = Shape(robot)
    starts, ends = shape.along(track)  # 2 x (m, p, 3)
    earliest = round((2.6 if spec.kind == "cooperation_then_collision" else 0.6) / FOLLOW_STEP_S)
    latest = len(track) - round(0.5 / FOLLOW_STEP_S)
    if latest <= earliest:
        return None
    parts = np.flatnonzero(np.isin(shape.link[:-1], _LINKS_IN_THE_WAY))  # the last capsule is the peg
    link = rng.choice(_LINKS_IN_THE_WAY)
    for _ in range(_TRIES):
        k = int(rng.integers(earliest, latest))
        part = int(rng.choice(parts[shape.link[parts] == link]))
        share = rng.uniform()
        before, point = starts[k - 1 : k + 1, part] + share * (ends - starts)[k - 1 : k + 1, part]
        velocity = (point - before) / FOLLOW_STEP_S
        speed = float(np.linalg.norm(velocity))
        if speed < _LEAST_SPEED_M_S:
            continue
        ahead = velocity / speed
        across = np.cross(ahead, rng.standard_normal(3))
        across /= np.linalg.norm(across)
        thick = rng.uniform(0.012, 0.03)
        middle = point + (shape.radius[part] + thick) * ahead
        half = rng.uniform(0.08, 0.15) * across
        if min((middle - half)[2], (middle + half)[2]) < 0.03:
            continue
        gap = capsule_gap(starts[k], ends[k], shape.radius, middle - half, middle + half, thick)
        if np.argmin(gap) != part:
            continue
        earlier = slice(0, max(k - round(_NEAR_S / FOLLOW_STEP_S), 1), 2)
        gaps = capsule_gap(starts[earlier], ends[earlier], shape.radius, middle - half, middle + half, thick)  # (m, p)
        if gaps.min() < _NEAR_M or gaps[0].min() < 0.03:
            continue
        bar = Bar(start_m=tuple(middle - half), end_m=tuple(middle + half), radius_m=thick)
        remedy = -0.6 * ahead + np.cross(ahead, across) * rng.choice([-1.0, 1.0])
        return bar, k * FOLLOW_STEP_S, remedy / np.linalg.norm(remedy)
    return None
