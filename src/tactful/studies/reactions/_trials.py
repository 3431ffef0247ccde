"""One collision: the arm runs into a post, the monitor tells it, the reaction does what it does."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tactful.control import MinimumJerkPath, Pose
from tactful.dynamics import Dynamics
from tactful.monitor import Monitor, MonitorConfig
from tactful.reaction import Reactor, load_policy
from tactful.robots import Robot
from tactful.simulation import Box, CellConfig, WorkCell

Trial = dict[str, float]

POLICIES = ("continue", "stop", "retract", "comply")
TIME_S = 4.0
SETTLED_S = 0.5
CONFIG = MonitorConfig(
    robot={"model": "panda"},
    noise={"velocity_rad_s": 0.001, "torque_nm": 0.05, "model_nm": 0.2},
)
_START = np.array([-0.5, 0.1, 0.0, -2.2, 0.0, 2.3, np.pi / 4])
_WAY_M = 0.5


@dataclass(frozen=True)
class Draw:
    """What is drawn for a collision; all reactions meet the same."""

    face_m: float
    """Where the post begins along the way of the tip [m]."""
    way_s: float
    """Time for the way of half a metre [s]."""
    contact_time_s: float
    """Time constant of the post's surface: smaller is harder [s]."""

    @classmethod
    def of(cls, rng: np.random.Generator) -> Draw:
        """Draw a collision."""
        return cls(rng.uniform(0.15, 0.3), rng.uniform(2.0, 5.0), rng.uniform(0.01, 0.04))


def collide(seed: tuple[int, ...], policy: str) -> Trial:
    """Run one collision, and return what really pressed.

    Args:
        seed: what the collision is drawn from.
        policy: name of the reaction.
    """
    rng = np.random.default_rng(seed)
    draw = Draw.of(rng)
    robot = Robot.load("panda")
    rotation, start = Dynamics(robot).pose(_START)
    there = Pose(rotation, start + np.array([0.0, _WAY_M, 0.0]))
    path = MinimumJerkPath([(0.6, Pose(rotation, start)), (0.6 + draw.way_s, there)])
    top = start[2] + 0.03
    post = Box(name="post", centre_m=(start[0], start[1] + draw.face_m + 0.02, top / 2), size_m=(0.08, 0.04, top))
    config = CellConfig(contact_time_s=draw.contact_time_s)
    cell = WorkCell(robot, [post], config=config, q=_START, rng=rng)
    monitor = Monitor(robot, CONFIG)
    reactor = Reactor(robot, path.pose, load_policy(policy), posture=_START)
    tau = reactor.torque(cell.t, cell.q, cell.dq)
    told_s = speed = np.nan
    force: list[float] = []
    dynamics = Dynamics(robot)
    while cell.t < TIME_S:
        sample = cell.step(tau)
        event = monitor.update(*sample[:4])
        touched = cell.tau_ext.any()
        J = dynamics.jacobian(sample.q) if touched else None
        force.append(0.0 if J is None else float(np.linalg.norm(np.linalg.pinv(J.T) @ cell.tau_ext)))
        if touched and np.isnan(speed) and J is not None:
            speed = float(np.linalg.norm(J[:3] @ sample.dq))
        if event is not None:
            if np.isnan(told_s):
                told_s = sample.t
            reactor.react(event, sample.t, sample.q)
        tau = reactor.torque(sample.t, sample.q, sample.dq)
    contacts = cell.contacts
    touch_s = contacts[0].touch_s if contacts else np.nan
    after = [f for k, f in enumerate(force) if k * config.period_s >= touch_s + SETTLED_S]
    return {
        "touched": float(bool(contacts)),
        "told": float(told_s - touch_s),
        "speed_m_s": speed,
        "peak_n": max((contact.peak_force_n for contact in contacts), default=0.0),
        "contact_s": sum(contact.end_s - contact.touch_s for contact in contacts),
        "later_n": max(after, default=0.0),
        "rest_rad_s": float(np.abs(cell.dq).max()),
    }
