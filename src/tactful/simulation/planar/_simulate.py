"""Impacts of the planar arm: one, or many at once."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tactful.dynamics import arm_record, motion_record
from tactful.errors import TactfulError
from tactful.estimation import ObserverConfig
from tactful.estimation._momentum_observer import observer_record
from tactful.impacts import ImpactPlan
from tactful.recordings import Label, Recording
from tactful.simulation.planar._arm import absolute, inverse_kinematics, planar_robot
from tactful.simulation.planar._config import PlanarConfig
from tactful.simulation.planar._dynamics import plant_record
from tactful.simulation.planar._loop import EVENTS, loop_record, run
from tactful.simulation.planar._plan import plan_impact

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Touch:
    """A contact point that comes onto the surface: when [s], which one, and how fast [m/s].

    The two points after the last one are the ends of a surface that come onto the face of the tool.
    """

    time_s: float
    point: int
    speed_m_s: float


@dataclass(frozen=True, eq=False)
class PlanarImpact:
    """What happened in a simulated impact; N samples, c contact points.

    Attributes:
        alpha_deg: angle of approach [deg].
        x_imp_m: where the impact was planned [m].
        beta_deg: inclination of the surface [deg].
        plan: what was expected.
        t: (N,) [s].
        q: (N, 3) measured joint positions, at the links [rad].
        dq: (N, 3) measured joint velocities, at the links [rad/s].
        tau: (N, 3) measured joint torques tau_J = K (theta - q) [Nm].
        tau_ext: (N, 3) true external torques [Nm].
        r: (N, 3) residual of the momentum observer in the loop [Nm].
        force_n: (N, c + 2, 2) true normal and tangential forces at the contact points, and at the two ends of the
            surface [N].
        touches: true landings, in order of time.
        detected_s: impacts that the controller detected; it switched at the first [s].
    """

    alpha_deg: float
    x_imp_m: float
    beta_deg: float
    plan: ImpactPlan
    t: Array
    q: Array
    dq: Array
    tau: Array
    tau_ext: Array
    r: Array
    force_n: Array
    touches: tuple[Touch, ...]
    detected_s: Array

    def recording(self) -> Recording:
        """The run as a recording, with a label `impact` from the first touch to the last."""
        times = [touch.time_s for touch in self.touches]
        labels = (Label("impact", times[0], times[-1], 2),) if times else ()
        channels = {"q": self.q, "dq": self.dq, "tau": self.tau}
        where = f"alpha {self.alpha_deg:g} deg, x {self.x_imp_m:g} m, beta {self.beta_deg:g} deg"
        return Recording(self.t, channels, labels, source=f"simulated planar impact, {where}")


def simulate_impact(
    alpha_deg: float, x_imp_m: float, beta_deg: float, config: PlanarConfig | None = None, seed: int = 0
) -> PlanarImpact:
    """Simulate one impact of the planar arm on a surface that is inclined about the place of the planned impact.

    The arm obeys (1) of the paper: links and motors with elastic joints in between, a compliant contact, and the
    impact-aware controller in the loop, which plans for a horizontal surface.

    Source: B. Proper et al. 2023, https://hal.science/hal-03974694v3, Sec. IV-A.

    Args:
        alpha_deg: angle of approach [deg].
        x_imp_m: where the impact is planned [m].
        beta_deg: inclination of the surface [deg].
        config: arm, task, contact, controller, sensors.
        seed: what the noise of the sensors is drawn from, with the case.

    Raises:
        TactfulError: if the motion is out of reach.
    """
    return simulate_impacts([(alpha_deg, x_imp_m, beta_deg)], config, seed)[0]


def simulate_impacts(
    cases: Sequence[tuple[float, float, float]] | ArrayLike,
    config: PlanarConfig | None = None,
    seed: int = 0,
    jobs: int = 1,
) -> list[PlanarImpact]:
    """Simulate many impacts; the result depends neither on the number of jobs nor on the other cases.

    Args:
        cases: (k, 3) alpha [deg], x_imp [m] and beta [deg].
        config: as in `simulate_impact`.
        seed: as in `simulate_impact`.
        jobs: number of threads; the kernel runs beside Python.

    Raises:
        TactfulError: as in `simulate_impact`, or if the cases have another shape.
    """
    config = config or PlanarConfig()
    wanted = np.asarray(cases, dtype=np.float64)
    if wanted.ndim != 2 or wanted.shape[1] != 3 or not np.isfinite(wanted).all():
        raise TactfulError(f"cases have shape {wanted.shape}: give rows of alpha [deg], x_imp [m], beta [deg]")
    if jobs < 1:
        raise TactfulError(f"jobs is {jobs}: it has to be at least 1")
    plans: dict[tuple[float, float], Any] = {}
    for alpha, x_imp, _ in wanted:
        if (alpha, x_imp) not in plans:
            plans[alpha, x_imp] = plan_impact(alpha, x_imp, config)
    shares = [wanted[i::jobs] for i in range(min(jobs, len(wanted)))]
    with ThreadPoolExecutor(len(shares) or 1) as pool:
        parts = list(pool.map(lambda share: _simulate(share, config, seed, plans), shares))
    return [parts[i % jobs][i // jobs] for i in range(len(wanted))]


def _simulate(cases: Array, config: PlanarConfig, seed: int, plans: dict[Any, Any]) -> list[PlanarImpact]:
    robot = planar_robot(config.arm)
    observing = ObserverConfig(bandwidth_hz=config.observer_gain / (2 * np.pi), joint_flexibility=True)
    records: list[Any] = [plant_record(config), loop_record(config), arm_record(robot), motion_record(3)]
    records.append(observer_record(robot, observing))
    plant, *_, observer = rows_of = [record[0] for record in records]
    clean = (plant.copy(), rows_of[1].copy(), observer.copy())
    N, c = config.samples, len(config.arm.offsets_m) + 2
    noisy = config.sensors.encoder_noise_rad > 0 or config.sensors.torque_noise_nm > 0
    t: Array = config.period_s * np.arange(N, dtype=np.float64)
    runs = []
    for alpha, x_imp, beta in cases:
        plan, reference = plans[alpha, x_imp]
        records[0][0], records[1][0], records[4][0] = clean
        plant["surface"] = x_imp, config.task.height_m + config.task.surface_offset_m
        plant["normal"] = -np.sin(np.radians(beta)), np.cos(np.radians(beta))
        noise = np.empty((0, 6))
        if noisy:
            key = [seed, *(round(1e6 * value) & 0xFFFFFFFF for value in (alpha, x_imp, beta))]
            noise = np.random.default_rng(key).standard_normal((N, 6))
        start = absolute(inverse_kinematics(config.arm, reference.at(0.0, post=False)[0], config.task.elbow))
        rows, r, force = np.empty((N, 12)), np.empty((N, 3)), np.empty((N, c, 2))
        touches, detected = np.empty((EVENTS, 3)), np.empty(EVENTS)
        n_touch, n_detect = run(
            *rows_of, reference.times_s, reference.coefficients, start, noise, rows, r, force, touches, detected
        )
        q, dq, tau, tau_ext = (np.ascontiguousarray(rows[:, 3 * i : 3 * i + 3]) for i in range(4))
        landed = tuple(Touch(float(s), int(p), float(v)) for s, p, v in touches[:n_touch])
        runs.append(
            PlanarImpact(alpha, x_imp, beta, plan, t, q, dq, tau, tau_ext, r, force, landed, detected[:n_detect].copy())
        )
    return runs
