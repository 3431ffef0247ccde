"""An arm in simulation, in real time: it goes to and fro, and can be touched."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tactful.control import Pose
from tactful.live._clock import Clock
from tactful.live._source import Sample, Source, SourceError
from tactful.live.sources import Settings, fill_in
from tactful.live.sources._arm import find_arm
from tactful.monitor import MonitorConfig

Array = NDArray[np.float64]

FORM = "sim or sim:SEED"

CONFIG = Path(__file__).with_name("sim.toml")
"""Settings of the monitor for this arm, as `python -m benchmarks.sim_config` found them."""
SENSORS = "clean"
"""The preset of the arm's sensors."""
_ARM = "panda"
_HAND_M_S, _OBSTACLE_M_S = 1.0, 0.3
"""How fast a hand and the obstacle follow where they are to be, so that no force is a step."""
_STIFFNESS_N_M, _DAMPING_NS_M, _GRIP_S = 300.0, 4.0, 0.15
"""The hand's, and the time in which it closes: it does not stop a moving arm before it has moved itself."""
_PAUSE_S = 0.01
_HELP_S = 4.6
"""When in a round of the plan a hand takes hold of the arm; the obstacle comes at its begin [s]."""
_HELPED_S, _AWAY_S = 0.7, 1.8
"""After what time the hand lets go and the obstacle is taken away [s]."""
_HELP_M = (0.0, -0.35, 0.0)


class SimSource(Source):
    """An arm that goes to and fro in simulation, until it is told to end.

    Args:
        name: what the user called it.
        settings: the arm as the monitor knows it, and the speed.
        alone: whether nobody else is there to touch it: then an obstacle comes into its way and a hand helps it, in
            every round.
    """

    commanded = True
    timed = False

    def __init__(self, name: str, settings: Settings, *, alone: bool = True) -> None:
        self.name, self._alone = name, alone
        self.config = fill_in(settings.config, MonitorConfig.load(CONFIG))
        self.robot = find_arm(name, self.config, default=_ARM)
        self.speed, self.paused = settings.speed, False
        self._clock = Clock(self.speed)

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
        self._round_s = 2 * (self.shop.plan.path.end_s + self.shop.plan.rest_s)
        self._plan_s, self._before_s = 0.0, np.inf
        self._due: list[tuple[float, Callable[[], None]]] = []

    def read(self) -> Sample | None:
        """Hold the torque for one period, and return the sample at its begin."""
        if self.paused:
            time.sleep(_PAUSE_S)
            self._clock.restart()
            return None
        self._clock.wait(self.cell.t)
        if self._alone:
            self._meet()
        self._follow()
        return Sample(*self.cell.step(self._tau)[:4])

    def command(self, tau: Array) -> None:
        """Take the torque for the next period."""
        self._tau = tau

    def plan(self, t: float) -> Pose:
        """Return where the tip is to be."""
        self._plan_s = t
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

    def _meet(self) -> None:
        """Let the obstacle or a hand come when the plan is there, and go some time after."""
        now, before = self._plan_s % self._round_s, self._before_s
        self._before_s = now
        if now < before:
            self.put(self.shop.in_the_way_m)
            self._due.append((self.cell.t + _AWAY_S, lambda: self.put(self.shop.aside_m)))
        elif before < _HELP_S <= now:
            tip = self.cell.data.body(self.shop.hands[-1].link).xpos.copy()
            self.grab(len(self.shop.hands) - 1, tip)
            self.pull(tip + _HELP_M)
            self._due.append((self.cell.t + _HELPED_S, self.let_go))
        while self._due and self._due[0][0] <= self.cell.t:
            self._due.pop(0)[1]()

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


def create(name: str, address: str, settings: Settings) -> Source:
    """See `tactful.live.sources`."""
    try:
        seed = int(address or 0)
    except ValueError:
        seed = -1
    if seed < 0:
        raise SourceError(name, f"{address!r} is no seed: give a whole number from 0 on, or nothing")
    if (model := settings.config.robot.model) not in (None, _ARM):
        raise SourceError(name, f"the arm in the cell is a {_ARM}, not {model}")
    return SimSource(name, settings)
