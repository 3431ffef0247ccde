"""The workshop as a source: what the page does to the arm happens between two samples."""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tactful.control import Pose
from tactful.live._clock import Clock
from tactful.live._source import Sample, Source
from tactful.live.sources import Settings
from tactful.live.sources._arm import find_arm

Array = NDArray[np.float64]

CONFIG = Path(__file__).with_name("workshop.toml")
"""Settings of the monitor for this arm, as `python -m benchmarks.workshop_config` found them."""
_HAND_M_S, _OBSTACLE_M_S = 1.0, 0.3
"""How fast a hand and the obstacle follow the mouse, so that no force is a step."""
_STIFFNESS_N_M, _DAMPING_NS_M, _GRIP_S = 300.0, 4.0, 0.15
"""The hand's, and the time in which it closes: it does not stop a moving arm before the mouse has moved."""
_PAUSE_S = 0.01
SENSORS = "clean"
"""The preset of sensors of the arm in the workshop."""


class WorkshopSource(Source):
    """An arm that goes to and fro in simulation, until it is told to end.

    Args:
        name: what the user called it.
        settings: the arm as the monitor knows it, and the speed.
    """

    commanded = True

    def __init__(self, name: str, settings: Settings) -> None:
        self.name = name
        self.robot = find_arm(name, settings.config, default="panda")
        self.speed = settings.speed or None
        self.paused = False
        self._clock = Clock(settings.speed)

    def open(self) -> None:
        """Build the cell."""
        from tactful.simulation import SensorConfig, workshop

        seed = int(self.name.partition(":")[2] or 0)
        self.shop = workshop(np.random.default_rng(seed), sensors=SensorConfig.preset(SENSORS))
        self.cell = self.shop.cell
        self.rate_hz = 1 / self.cell.config.period_s
        self.obstacle_m = self.shop.aside_m.copy()
        self._obstacle_target: Array | None = None
        self._hand, self._hand_target = self.shop.hands[0], np.zeros(3)
        self._grip = 0.0
        self._tau = np.zeros(self.cell.robot.n)

    def read(self) -> Sample | None:
        """Hold the torque for one period, and return the sample at its begin."""
        if self.paused:
            time.sleep(_PAUSE_S)
            self._clock.restart()
            return None
        self._clock.wait(self.cell.t)
        self._follow()
        return Sample(*self.cell.step(self._tau)[:4])

    def command(self, tau: Array) -> None:
        """Take the torque for the next period."""
        self._tau = tau

    def plan(self, t: float) -> Pose:
        """Return where the tip is to be."""
        return self.shop.plan(t)

    @property
    def posture(self) -> ArrayLike:
        """Return the posture at the start."""
        return self.shop.posture

    def close(self) -> None:
        """Leave the cell as it is: its truth can be asked for."""

    def grab(self, link: int, point_m: Array) -> None:
        """Take hold of a point of a link (3,) [m]."""
        self.let_go()
        self._hand = self.shop.hands[link]
        x, R = self._link_pose()
        self._hand.point_m = tuple((R.T @ (point_m - x)).tolist())
        self._hand_target = point_m
        self._hand.target_m = tuple(point_m.tolist())
        self._grip = 0.0

    def pull(self, target_m: Array) -> None:
        """Draw the point that is held somewhere (3,) [m]."""
        self._hand_target = target_m

    def let_go(self) -> None:
        """Touch nothing."""
        self._hand.target_m = None

    def hand(self) -> tuple[Array, Array] | None:
        """Return what is held and where it is drawn, (3,) each [m]; None where nothing is."""
        target = self._hand.target_m
        if target is None:
            return None
        x, R = self._link_pose()
        return x + R @ self._hand.point_m, np.array(target)

    def put(self, obstacle_m: Array) -> None:
        """Bring the obstacle somewhere (3,) [m]."""
        self._obstacle_target = obstacle_m

    def _link_pose(self) -> tuple[Array, Array]:
        body = self.cell.data.body(self._hand.link)
        return body.xpos.copy(), body.xmat.reshape(3, 3).copy()

    def _follow(self) -> None:
        """Let hand and obstacle come nearer to where they are to be."""
        if self._hand.target_m is not None:
            self._grip = min(1.0, self._grip + 1 / (_GRIP_S * self.rate_hz))
            self._hand.stiffness_n_m, self._hand.damping_ns_m = self._grip * _STIFFNESS_N_M, self._grip * _DAMPING_NS_M
            hand_m = np.array(self._hand.target_m)
            self._hand.target_m = tuple(_nearer(hand_m, self._hand_target, _HAND_M_S / self.rate_hz).tolist())
        if self._obstacle_target is not None:
            self.obstacle_m = _nearer(self.obstacle_m, self._obstacle_target, _OBSTACLE_M_S / self.rate_hz)
            self.shop.move(self.obstacle_m)
            if np.array_equal(self.obstacle_m, self._obstacle_target):
                self._obstacle_target = None


def _nearer(here: Array, there: Array, step_m: float) -> Array:
    way = there - here
    length = float(np.linalg.norm(way))
    return there if length <= step_m else here + way * (step_m / length)
