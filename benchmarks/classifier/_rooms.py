"""Scenes that have little in common with the peg and its box: any arm, motion, thing and hand."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tactful import Recording, Robot
from tactful.control import CartesianImpedance, MinimumJerkPath, Pose, minimum_jerk
from tactful.dynamics import Dynamics
from tactful.errors import TactfulError
from tactful.simulation import Bar, Box, CellConfig, Fixture, Guide, Push, SensorConfig, WorkCell
from tactful.simulation._shape import Shape

Array = NDArray[np.float64]

_STEP_S = 0.002
_AFTER_S = 1.0
_MOST_N = 250.0
"""Force beyond which something broke [N]."""


@dataclass(frozen=True)
class JointImpedance:
    """Springs and dampers from the joints to where they should be, through the mass matrix: tau = M (K e + D de)."""

    dynamics: Dynamics
    stiffness: float
    """K [1/s^2]."""

    def torque(self, q: Array, dq: Array, q_d: Array, dq_d: Array) -> Array:
        """Return the torque (n,) without that of gravity [Nm]."""
        K = self.stiffness
        ddq = K * (q_d - q) + 2 * np.sqrt(K) * (dq_d - dq)
        return np.asarray(self.dynamics.mass_matrix(q) @ ddq)


@dataclass(frozen=True)
class JointPath:
    """Joint positions from rest to rest through a few postures (k, n) [rad]."""

    postures: Array
    times: Array
    """When each is reached (k,) [s]."""

    @property
    def end_s(self) -> float:
        """When the last one is reached [s]."""
        return float(self.times[-1])

    def at(self, t: float) -> Array:
        """Return the positions (n,) [rad]."""
        leg = int(np.clip(np.searchsorted(self.times, t) - 1, 0, len(self.times) - 2))
        share = minimum_jerk((t - self.times[leg]) / (self.times[leg + 1] - self.times[leg]))
        return np.asarray(self.postures[leg] + share * (self.postures[leg + 1] - self.postures[leg]))


def room(robot: Robot, rng: np.random.Generator, *, straight: bool) -> Recording | None:
    """Return an episode of contacts in a random scene, or None where what was drawn comes to nothing.

    Hands push or draw in all directions, rise within 15 to 600 ms, on any of the outer links; bars and boxes, soft or
    stiff, stand in the way of any of them.

    Args:
        robot: the arm.
        rng: the source of everything.
        straight: whether the tip goes straight under Cartesian impedance, or the joints from posture to posture.
    """
    dynamics, path = Dynamics(robot), _joint_path(robot, rng)
    start, end_s = path.postures[0], path.end_s
    poses = None
    if straight:
        rotation, tip = dynamics.pose(start)
        way = _direction(rng) * (1.0, 1.0, 0.5) * rng.uniform(0.2, 0.4)
        end_s = 0.6 + rng.uniform(1.5, 3.5)
        poses = MinimumJerkPath([(0.6, Pose(rotation, tip)), (end_s, Pose(rotation, tip + way))])
    collides = rng.uniform() < 0.6
    config = CellConfig(
        contact_time_s=float(np.exp(rng.uniform(np.log(0.008), np.log(0.05)))),
        contact_depth_m=float(np.exp(rng.uniform(np.log(5e-4), np.log(6e-3)))),
        friction=float(rng.uniform(0.0, 0.6)),
    )
    track = _track(robot, path, poses, start, end_s)
    thing = _in_the_way(robot, track, rng) if collides and track is not None else None
    if track is None or (collides and thing is None):
        return None
    cell = WorkCell(robot, [thing[0]] if thing else [], config=config, sensors=SensorConfig(), q=start, rng=rng)
    if thing is None:
        first_s = float(rng.uniform(0.8, 0.9 * end_s + 0.38))
        touches = [first_s, first_s + float(rng.uniform(1.2, 2.0))]
    else:
        touches = [thing[1] + float(rng.uniform(0.2, 1.5))] if rng.uniform() < 0.55 else []
    try:
        return _run(robot, dynamics, cell, path, poses, touches, max(end_s, *touches, 0.0) + _AFTER_S, rng)
    except TactfulError:
        return None


def _controller(robot: Robot, dynamics: Dynamics, poses: MinimumJerkPath | None, start: Array, stiffness: float) -> Any:
    if poses is not None:
        return CartesianImpedance(robot, posture=start)
    return JointImpedance(dynamics, stiffness)


def _command(controller: Any, cell: WorkCell, path: JointPath, poses: MinimumJerkPath | None, t: float) -> Array:
    if poses is not None:
        return np.asarray(controller.torque(cell.q, cell.dq, *poses.pose(t)))
    q, later = path.at(t), path.at(t + _STEP_S)
    return np.asarray(controller.torque(cell.q, cell.dq, q, (later - q) / _STEP_S))


def _track(robot: Robot, path: JointPath, poses: MinimumJerkPath | None, start: Array, end_s: float) -> Array | None:
    """Return where the joints would go without any contact (k, n), one row each 10 ms; None if near to the table."""
    if poses is None:
        track = np.array([path.at(t) for t in np.arange(0.0, end_s, 0.01)])
    else:
        cell = WorkCell(robot, sensors=SensorConfig.exact(), config=CellConfig(period_s=0.002), q=start, keep=False)
        controller = CartesianImpedance(robot, posture=start)
        rows = []
        while cell.t < end_s:
            rows.append(cell.q.copy())
            cell.step(_command(controller, cell, path, poses, cell.t))
        if cell.contacts_so_far:
            return None
        track = np.array(rows[::5])
    shape = Shape(robot)
    low = min(min(_ends(shape, q)[_outer(robot), :, 2].min() for q in track[::10]), 1.0)
    return track if low > 0.12 else None


def _run(
    robot: Robot,
    dynamics: Dynamics,
    cell: WorkCell,
    path: JointPath,
    poses: MinimumJerkPath | None,
    touches: list[float],
    end_s: float,
    rng: np.random.Generator,
) -> Recording | None:
    controller = _controller(robot, dynamics, poses, cell.q, float(np.exp(rng.uniform(np.log(80), np.log(600)))))
    while cell.t < end_s:
        if touches and cell.t >= touches[0]:
            touches.pop(0)
            cell.add_hand(_hand(robot, dynamics, cell, rng))
        cell.step(_command(controller, cell, path, poses, cell.t))
    recording = cell.recording()
    labels = recording.labels
    gentle = all(label.peak_force_n is not None and label.peak_force_n < _MOST_N for label in labels)
    return recording if labels and gentle and min(label.start_s for label in labels) > 0.4 else None


def _joint_path(robot: Robot, rng: np.random.Generator) -> JointPath:
    home = np.where(robot.home == 0.0, 0.15, robot.home)
    legs = int(rng.integers(1, 4))
    spread = np.where(np.arange(robot.n) < 3, 0.35, 0.6)
    postures = home + spread * rng.uniform(-1, 1, (legs + 1, robot.n))
    margin = 0.1
    postures = np.clip(postures, robot.lower + margin, robot.upper - margin)
    seconds = [max(0.8, float(np.ptp(pair, axis=0).max()) / rng.uniform(0.15, 0.7)) for pair in _pairs(postures)]
    return JointPath(postures, np.cumsum([0.6, *seconds]))


def _pairs(rows: Array) -> list[Array]:
    return [rows[k : k + 2] for k in range(len(rows) - 1)]


def _direction(rng: np.random.Generator) -> Array:
    u = rng.standard_normal(3)
    return np.asarray(u / np.linalg.norm(u))


def _ends(shape: Shape, q: Array) -> Array:
    """Return the ends of the axes of the capsules (p, 2, 3), base axes [m]."""
    start, end, _ = shape.at(q)
    return np.stack([start, end], axis=1)


def _outer(robot: Robot) -> list[int]:
    """Return the capsules of the outer links."""
    return [k for k, capsule in enumerate(robot.capsules) if capsule.link >= 2]


def _in_the_way(robot: Robot, track: Array, rng: np.random.Generator) -> tuple[Fixture, float] | None:
    """Return a bar or a box that a link meets on its way first, and when; None where none is found."""
    shape = Shape(robot)
    ends = np.array([_ends(shape, q) for q in track])  # (k, p, 2, 3)
    radius = np.array([capsule.radius_m for capsule in robot.capsules])
    for _ in range(60):
        k = int(rng.integers(60, max(len(track), 62)))
        part = int(rng.choice(_outer(robot)))
        if k >= len(track):
            return None
        share = rng.uniform()
        here = ends[k, part, 0] + share * (ends[k, part, 1] - ends[k, part, 0])
        before = ends[k - 1, part, 0] + share * (ends[k - 1, part, 1] - ends[k - 1, part, 0])
        speed = float(np.linalg.norm(here - before)) / 0.01
        if speed < 0.05:
            continue
        ahead = (here - before) / (0.01 * speed)
        fixture: Fixture
        if rng.uniform() < 0.5:
            thick = float(rng.uniform(0.01, 0.04))
            across = np.cross(ahead, _direction(rng))
            half = rng.uniform(0.05, 0.2) * across / np.linalg.norm(across)
            middle = here + (radius[part] + thick) * ahead
            fixture = Bar(start_m=tuple(middle - half), end_m=tuple(middle + half), radius_m=thick)
            line = np.linspace(middle - half, middle + half, 9)
            size = np.full(3, thick)
        else:
            size = rng.uniform(0.02, 0.12, 3)
            reach = float(np.min(size / np.maximum(np.abs(ahead), 1e-6)))
            middle = here + (radius[part] + reach) * ahead
            length, width, height = (2 * size).tolist()
            fixture = Box(centre_m=tuple(middle), size_m=(length, width, height))
            line = middle[None]
        if middle[2] - size[2] < 0.0:
            continue
        early = _gap(ends[: k - 10 : 5], radius, line, size)
        if early > 0.01:
            return fixture, 0.01 * k
    return None


def _gap(ends: Array, radius: Array, centres: Array, half: Array) -> float:
    """Return a lower bound of the distance of the capsules (k, p, 2, 3) to boxes about the centres (c, 3) [m]."""
    points = ends[:, :, :1] + np.linspace(0, 1, 6)[:, None] * (ends[:, :, 1:] - ends[:, :, :1])  # (k, p, 6, 3)
    away = np.maximum(np.abs(points[..., None, :] - centres) - half, 0.0)  # (k, p, 6, c, 3)
    return float((np.linalg.norm(away, axis=-1).min(axis=(2, 3)) - radius).min()) if len(ends) else 1.0


def _hand(robot: Robot, dynamics: Dynamics, cell: WorkCell, rng: np.random.Generator) -> Push | Guide:
    """Return a hand on one of the outer links, from now on."""
    q, ends = cell.q, _ends(Shape(robot), cell.q)
    for _ in range(50):
        part = int(rng.choice(_outer(robot)))
        link = robot.capsules[part].link
        axis = ends[part, 0] + rng.uniform() * (ends[part, 1] - ends[part, 0])
        force = rng.uniform(6.0, 30.0) * _direction(rng)
        J = dynamics.jacobian_at(q, link, axis)[:3]
        if np.linalg.norm(J.T @ force) > 0.15 * np.linalg.norm(force):
            break
    R, o = Shape(robot).link_pose(q, link)
    touch: dict[str, Any] = {
        "link": robot.link_names[link],
        "point_m": tuple((R.T @ (axis - o)).tolist()),
        "start_s": cell.t,
        "rise_s": float(np.exp(rng.uniform(np.log(0.015), np.log(0.6)))),
        "hold_s": float(rng.uniform(0.2, 1.0)),
        "fall_s": float(rng.uniform(0.05, 0.3)),
    }
    if rng.uniform() < 0.6:
        return Push(**touch, force_n=tuple(force.tolist()))
    size = float(np.linalg.norm(force))
    stiffness = float(rng.uniform(150, 600))
    target = axis + 1.5 * force / stiffness
    return Guide(
        **touch,
        target_m=tuple(target.tolist()),
        stiffness_n_m=stiffness,
        damping_ns_m=float(rng.uniform(5, 25)),
        strength_n=size,
    )
