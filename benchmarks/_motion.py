"""What the benchmarks monitor: an arm that swings, and is touched once a minute."""

from __future__ import annotations

from typing import Any

import numpy as np

from tactful import Recording, Robot
from tactful.dynamics import Dynamics

RATE_HZ = 1000.0
PERIOD_S = 60.0
TOUCH_S = (20.0, 20.5)
_NOISE_NM = 0.02


def swing(robot: Robot, duration_s: float, rng: np.random.Generator) -> Recording:
    """Return joint positions, velocities and torques at 1 kHz.

    Each joint swings by 0.2 rad, with a period that divides a minute. The torque is exact but for white noise, and for
    15 N that push the tip along each axis of the base from second 20 of every minute on, for half a second.
    """
    t = np.arange(round(duration_s * RATE_HZ)) / RATE_HZ
    period = np.arange(min(len(t), round(PERIOD_S * RATE_HZ))) / RATE_HZ
    w: Any = 2 * np.pi / PERIOD_S * np.arange(5, 5 + robot.n)
    q = robot.home + 0.2 * np.sin(np.outer(period, w))
    dq = 0.2 * w * np.cos(np.outer(period, w))
    ddq = -0.2 * w**2 * np.sin(np.outer(period, w))
    rise = np.clip((period - TOUCH_S[0]) / 0.02, 0, 1) * np.clip((TOUCH_S[1] - period) / 0.02, 0, 1)
    dynamics = Dynamics(robot)
    tau = np.empty_like(q)
    for k in range(len(period)):
        tau[k] = dynamics.inverse_dynamics(q[k], dq[k], ddq[k])
        if rise[k]:
            tau[k] -= dynamics.jacobian(q[k])[:3].sum(axis=0) * 15.0 * rise[k]
    rows = np.arange(len(t)) % len(period)
    noise = _NOISE_NM * rng.standard_normal((len(t), robot.n))
    return Recording(
        t=t, channels={"q": q[rows], "dq": dq[rows], "tau": tau[rows] + noise}, source="swing", format="made"
    )
