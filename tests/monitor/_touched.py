"""Recordings of arms that are touched, from inverse dynamics: exact, fast, without a simulator."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tactful import Recording, Robot
from tactful.dynamics import Dynamics

RATE_HZ = 1000.0


@dataclass(frozen=True)
class Touch:
    """A force at the tip that rises in `rise_s`, stays, and falls in `rise_s`."""

    start_s: float
    end_s: float
    force_n: tuple[float, float, float]
    rise_s: float = 0.02

    def at(self, t: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the force (k, 3) at the times t (k,)."""
        up = np.clip((t - self.start_s) / self.rise_s, 0, 1)
        down = np.clip((self.end_s - t) / self.rise_s, 0, 1)
        return np.minimum(up, down)[:, None] * np.array(self.force_n)


def recording(
    robot: Robot,
    *touches: Touch,
    duration_s: float = 4.0,
    speed_rad_s: float = 0.25,
    noise_nm: float = 0.0,
    seed: int = 0,
) -> Recording:
    """Return a slow swing of the first joint around home, with touches at the tip; F acts on the robot."""
    dynamics = Dynamics(robot)
    t = np.arange(round(duration_s * RATE_HZ)) / RATE_HZ
    swing = np.zeros(len(robot.joint_names))
    swing[0] = 1.0
    w = 2 * np.pi / 8.0
    q = robot.home + np.outer(speed_rad_s / w * np.sin(w * t), swing)
    dq = np.outer(speed_rad_s * np.cos(w * t), swing)
    ddq = np.outer(-speed_rad_s * w * np.sin(w * t), swing)
    force = sum((touch.at(t) for touch in touches), np.zeros((len(t), 3)))
    noise = noise_nm * np.random.default_rng(seed).normal(size=q.shape)
    tau = np.array(
        [
            dynamics.inverse_dynamics(q[k], dq[k], ddq[k]) - dynamics.jacobian(q[k])[:3].T @ force[k]
            for k in range(len(t))
        ]
    )
    return Recording(t=t, channels={"q": q, "dq": dq, "tau": tau + noise}, source="touched.csv", format="made")
