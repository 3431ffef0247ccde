"""Kernel of a run: plant, sensors, observer, detection and controller, sample by sample."""

from __future__ import annotations

import functools
import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tactful._njit import njit
from tactful.control._impact_aware import ANTE, INTERIM, POST, impact_aware_force
from tactful.control._reference_spreading import spread
from tactful.detection._impact import detect, impact_dtype, impact_record
from tactful.dynamics.kernels import copy
from tactful.estimation._momentum_observer import observe_motion
from tactful.simulation.planar._config import PlanarConfig
from tactful.simulation.planar._dynamics import contacts, inertia, joint_torque, step

Array = NDArray[np.float64]
Record = np.ndarray[tuple[int], np.dtype[np.void]]

EVENTS = 64
"""Touches and detections that are kept of a run; of more, the first ones."""


@functools.cache
def loop_dtype() -> np.dtype[np.void]:
    """Return the layout of controller, sensors and detection."""
    three = ("f8", (3,))
    return np.dtype(
        [
            ("stiffness", *three),
            ("damping", *three),
            ("normal_force", "f8"),
            ("friction", "f8"),
            ("interim", "f8"),  # [s]
            ("delay", "i8"),  # [samples]
            ("period", "f8"),
            ("coarse", "f8"),
            ("fine", "f8"),
            ("encoder_noise", "f8"),
            ("torque_noise", "f8"),
            ("smoothing", "f8"),  # share of the new difference in the velocity; 0: the velocity is measured
            ("detector", impact_dtype(3)),
            ("measured", "f8", (6,)),  # absolute angles and their rates
            ("x", *three),
            ("dx", *three),
            ("x_d", *three),
            ("dx_d", *three),
            ("ddx_d", *three),
            ("F", *three),
            ("ddq", *three),
            ("u", *three),
            ("q", *three),
            ("dq", *three),
            ("tau", *three),
            ("last_q", *three),
            ("held", "f8", (32, 3)),  # torques on their way
        ],
        align=True,
    )


def loop_record(config: PlanarConfig) -> Record:
    """Return controller, sensors and detection before a run."""
    record: Any = np.zeros(1, loop_dtype())
    loop = record[0]
    control, sensors = config.control, config.sensors
    loop["stiffness"], loop["damping"] = control.stiffness, control.damping
    loop["normal_force"], loop["friction"] = control.normal_force_n, control.friction
    loop["interim"], loop["delay"] = control.interim_s, control.delay_samples
    loop["period"], loop["coarse"], loop["fine"] = config.period_s, config.step_s, config.contact_step_s
    loop["encoder_noise"], loop["torque_noise"] = sensors.encoder_noise_rad, sensors.torque_noise_nm
    if sensors.velocity_cutoff_hz is not None:
        loop["smoothing"] = 1 - math.exp(-2 * math.pi * sensors.velocity_cutoff_hz * config.period_s)
    loop["detector"] = impact_record(3, config.impact)[0]
    return record  # type: ignore[no-any-return]


@njit(cache=True)
def _measure(loop: Any, plant: Any, first: bool, noise: Array) -> None:
    """Set q, dq and tau to what the sensors say of the state; `noise` (6,) has unit variance."""
    for i in range(3):
        q, dq = plant.state[i], plant.state[3 + i]
        if i > 0:
            q -= plant.state[i - 1]
            dq -= plant.state[2 + i]
        loop.q[i] = q + loop.encoder_noise * noise[i]
        loop.tau[i] = joint_torque(plant, plant.state, i)[0] + loop.torque_noise * noise[3 + i]
        if loop.smoothing == 0.0:
            loop.dq[i] = dq
        elif first:
            loop.dq[i] = 0.0
        else:
            loop.dq[i] += loop.smoothing * ((loop.q[i] - loop.last_q[i]) / loop.period - loop.dq[i])
        loop.last_q[i] = loop.q[i]


@njit(cache=True)
def _control(loop: Any, plant: Any, phase: int) -> None:
    """Set u (3,) from the measured state and the reference."""
    angle = rate = 0.0
    for i in range(3):
        angle += loop.q[i]
        rate += loop.dq[i]
        loop.measured[i], loop.measured[3 + i] = angle, rate
    inertia(plant, loop.measured)
    length, rates = plant.length, loop.measured[3:6]
    x = y = dx = dy = swing_x = swing_y = 0.0
    for i in range(3):
        c, s = length[i] * plant.cos[i], length[i] * plant.sin[i]
        x, y, dx, dy = x + c, y + s, dx - s * rates[i], dy + c * rates[i]
        swing_x, swing_y = swing_x - c * rates[i] * rates[i], swing_y - s * rates[i] * rates[i]
    loop.x[0], loop.x[1], loop.x[2] = x, y, angle
    loop.dx[0], loop.dx[1], loop.dx[2] = dx, dy, rate
    impact_aware_force(loop, phase, loop.x, loop.dx, loop.x_d, loop.dx_d, loop.F)
    # Angular accelerations of the links that follow the reference.
    last = loop.ddx_d[2]
    a_x = loop.ddx_d[0] - swing_x + length[2] * plant.sin[2] * last
    a_y = loop.ddx_d[1] - swing_y - length[2] * plant.cos[2] * last
    determinant = length[0] * length[1] * (plant.cos[0] * plant.sin[1] - plant.sin[0] * plant.cos[1])
    first = length[1] * (plant.cos[1] * a_x + plant.sin[1] * a_y) / determinant
    second = -length[0] * (plant.cos[0] * a_x + plant.sin[0] * a_y) / determinant
    loop.ddq[0], loop.ddq[1], loop.ddq[2] = first, second, last
    above = 0.0
    for i in range(2, -1, -1):
        above += plant.bias[i] + plant.M[i, 0] * first + plant.M[i, 1] * second + plant.M[i, 2] * last
        above += length[i] * (plant.cos[i] * loop.F[1] - plant.sin[i] * loop.F[0])
        if i == 2:
            above += loop.F[2]
        relative = loop.ddq[i] - (loop.ddq[i - 1] if i > 0 else 0.0)
        loop.u[i] = above + plant.B[i] * relative


@njit(cache=True)
def _start(plant: Any, start: Array) -> None:
    """Put the arm at rest at the absolute angles `start` (3,), in balance with gravity."""
    x = plant.state
    for i in range(3):
        x[i], x[3 + i], x[6 + i], x[9 + i] = start[i], 0.0, start[i] - (start[i - 1] if i > 0 else 0.0), 0.0
    x[12] = x[13] = 0.0
    inertia(plant, x)
    above = 0.0
    for i in range(2, -1, -1):
        above += plant.bias[i]
        x[6 + i] += above / plant.K[i]


@njit(cache=True, nogil=True)
def run(
    plant: Any,
    loop: Any,
    arm: Any,
    motion: Any,
    observer: Any,
    times: Array,
    coefficients: Array,
    start: Array,
    noise: Array,
    rows: Array,
    residual: Array,
    force: Array,
    touches: Array,
    detected: Array,
) -> tuple[int, int]:
    """Run one case.

    Sets rows (N, 12): q, dq, tau_J as measured and the true tau_ext; residual (N, 3); force (N, c + 2, 2): normal and
    tangential; touches (EVENTS, 3): time, point and speed of approach; detected (EVENTS,). Returns how many touches
    and detections.
    """
    points = plant.gap.shape[0]
    _start(plant, start)
    observer.started = 0
    landed = np.zeros(points, dtype=np.bool_)
    silent = np.zeros(6)
    n_touch = n_detect = 0
    latest = -1e9
    for k in range(rows.shape[0]):
        t = k * loop.period
        _measure(loop, plant, k == 0, noise[k] if noise.shape[0] > 0 else silent)
        for i in range(3):
            rows[k, i], rows[k, 3 + i], rows[k, 6 + i] = loop.q[i], loop.dq[i], loop.tau[i]
            plant.Q[i] = 0.0
        inertia(plant, plant.state)
        contacts(plant, plant.state)
        above = 0.0
        for i in range(2, -1, -1):
            above += plant.Q[i]
            rows[k, 9 + i] = above
        for c in range(points):
            force[k, c, 0], force[k, c, 1] = plant.F_n[c], plant.F_t[c]
        observe_motion(arm, motion, observer, loop.period, loop.q, loop.dq, loop.tau)
        copy(observer.r, residual[k])
        if detect(loop.detector, loop.period, observer.r):
            latest = t
            if n_detect < EVENTS:
                detected[n_detect] = t
                n_detect += 1
        phase = ANTE if n_detect == 0 else (INTERIM if t - latest < loop.interim else POST)
        spread(times, coefficients, phase != ANTE, t, loop.x_d, loop.dx_d, loop.ddx_d)
        _control(loop, plant, phase)
        size = loop.delay + 1
        for i in range(3):
            loop.held[k % size, i] = loop.u[i]
        u = loop.held[max(k - loop.delay, 0) % size]
        left = loop.period
        while left > 1e-9:
            left -= step(plant, u, left, loop.coarse, loop.fine)
            for c in range(points):
                if plant.gap[c] < 0.0 and not landed[c] and n_touch < EVENTS:
                    touches[n_touch, 0] = t + loop.period - left
                    touches[n_touch, 1], touches[n_touch, 2] = c, plant.closing[c]
                    n_touch += 1
                landed[c] = plant.gap[c] < 0.0
    return n_touch, n_detect
