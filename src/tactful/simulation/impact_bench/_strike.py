"""One impact of an arm with a flat tool on a platform."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tactful.control import ImpactAwareController
from tactful.control._impact_aware_arm import Phase
from tactful.detection import ImpactDetector
from tactful.estimation import MomentumObserver, ObserverConfig
from tactful.recordings import Label, Recording
from tactful.robots import Robot
from tactful.simulation._peg import mistaken
from tactful.simulation._work_cell import WorkCell
from tactful.simulation.impact_bench._config import BenchConfig
from tactful.simulation.impact_bench._plan import FACE_DOWN, NORMAL, BenchPlan

Array = NDArray[np.float64]

_HALF_SIZE_M = (0.2, 0.2, 0.02)
"""Half the platform's size: it is to be met by the tool alone [m]."""


@dataclass(frozen=True)
class _Platform:
    """A plate that is turned about y, through the middle of its upper side."""

    centre_m: tuple[float, float, float]
    inclination_rad: float
    name: str = "platform"

    def attach(self, world: Any) -> None:
        import mujoco

        c, s = math.cos(self.inclination_rad / 2), math.sin(self.inclination_rad / 2)
        body = world.add_body(name=self.name, pos=self.centre_m, quat=[c, 0.0, -s, 0.0])
        body.add_geom(type=mujoco.mjtGeom.mjGEOM_BOX, size=_HALF_SIZE_M, pos=[0.0, 0.0, -_HALF_SIZE_M[2]])


@dataclass(frozen=True, eq=False)
class Strike:
    """What happened in a simulated impact; N samples, n joints.

    Attributes:
        plan: what was planned.
        beta_deg: inclination of the platform, as it was set [deg].
        t: (N,) [s].
        q: (N, n) measured joint positions [rad].
        dq: (N, n) measured joint velocities [rad/s].
        tau: (N, n) measured joint torques, gravity included [Nm].
        tau_ext: (N, n) true external torques [Nm].
        r: (N, n) residual of the momentum observer in the loop [Nm].
        touch_s: when the tool touched the platform; inf if it never did [s].
        detected_s: impacts that the controller detected; it switched at the first [s].
    """

    plan: BenchPlan
    beta_deg: float
    t: Array
    q: Array
    dq: Array
    tau: Array
    tau_ext: Array
    r: Array
    touch_s: float
    detected_s: Array

    def recording(self) -> Recording:
        """The run as a recording; a label `impact` begins at the detection of the first impact, if there was one."""
        labels = (
            (Label("impact", float(self.detected_s[0]), float(self.detected_s[-1])),) if len(self.detected_s) else ()
        )
        channels = {"q": self.q, "dq": self.dq, "tau": self.tau}
        return Recording(self.t, channels, labels, source=f"simulated impact, platform at {self.beta_deg:g} deg")


def true_arm(robot: Robot, config: BenchConfig) -> Robot:
    """Return the arm as it is in truth, where `robot` is its model."""
    return mistaken(robot, np.random.default_rng([config.arm_seed, 1]), scale=config.model_error)


def strike(
    plan: BenchPlan, beta_deg: float, config: BenchConfig | None = None, seed: int | Sequence[int] = 0
) -> Strike:
    """Let an arm strike a platform that is inclined about the place of the planned impact, as planned for a level one.

    The arm has elastic joints: in MuJoCo, a second hinge with spring and damper behind each motor. Four round feet
    meet the platform in MuJoCo's own contact, with friction. In the loop at 1 kHz: momentum observer, detection of
    impacts, and the impact-aware controller, from measured signals and with the model that the planner has.

    Args:
        plan: what is planned, with the same `config`.
        beta_deg: inclination of the platform; a positive one raises its far side [deg].
        config: the bench.
        seed: what noise, height and inclination are drawn from.

    Raises:
        TactfulError: if MuJoCo is not installed.
    """
    config = config or BenchConfig()
    task, robot = config.task, plan.robot
    rng = np.random.default_rng([*np.atleast_1d(seed).tolist(), round(1e6 * beta_deg) & 0xFFFFFFFF])
    height, tilt = rng.standard_normal(2) * [config.height_sd_m, math.radians(config.inclination_sd_deg)]
    platform = _Platform((task.x_m, 0.0, task.height_m + height), math.radians(beta_deg) + tilt)
    cell = WorkCell(
        true_arm(robot, config),
        [platform],
        config=config.cell,
        sensors=config.sensors,
        q=plan.q_start,
        rng=rng,
        arm_rng=np.random.default_rng(config.arm_seed),
        keep=False,
    )
    controller = ImpactAwareController(
        robot, plan.reference, FACE_DOWN, NORMAL, plan.impact.q_d, config.control, gravity=False
    )
    observer = MomentumObserver(robot, ObserverConfig(bandwidth_hz=config.observer_gain / (2 * math.pi)))
    detector = ImpactDetector(robot.n, config.impact)
    rows: list[tuple[Any, ...]] = []
    detected: list[float] = []
    touch_s = math.inf
    for _ in range(round(config.duration_s / config.cell.period_s)):
        phase: Phase = "ante"
        if detected:
            phase = "interim" if cell.t - detected[-1] < config.control.interim_s else "post"
        sample = cell.step(controller.torque(cell.t, cell.q, cell.dq, phase))
        r = observer.update(sample.t, sample.q, sample.dq, sample.tau)
        if detector.update(sample.t, r):
            detected.append(sample.t)
        if touch_s == math.inf and cell.tau_ext.any():
            touch_s = sample.t
        rows.append((*sample, cell.tau_ext, r))
    t, q, dq, tau, tau_ext, r_all = (np.array(column) for column in zip(*rows, strict=True))
    return Strike(plan, beta_deg, t, q, dq, tau, tau_ext, r_all, touch_s, np.array(detected))
