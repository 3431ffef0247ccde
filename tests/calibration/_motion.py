"""Free motion of a simulated arm whose figures are known."""

from functools import cache

import numpy as np

from tactful.calibration._pseudo_inertia import PARAMETERS, LinkChart, robot_parameters, with_parameters
from tactful.dynamics import Dynamics
from tactful.recordings import Recording
from tactful.robots import Robot

BIAS = np.array([0.5, -0.4, 0.3, -0.2, 0.1, -0.1, 0.05])
COULOMB = np.array([0.4, 0.3, 0.35, 0.5, 0.2, 0.15, 0.2])
VISCOUS = np.array([0.2, 0.1, 0.15, 0.1, 0.05, 0.05, 0.02])
PAYLOAD = 1.2, np.array([0.02, -0.03, 0.06])


def other_arm(robot: Robot, seed: int, spread: float = 0.1) -> Robot:
    """Return an arm whose links differ from the nominal ones by about `spread`."""
    rng = np.random.default_rng(seed)
    rows = [
        LinkChart(row)(spread * LinkChart.scale * rng.normal(size=PARAMETERS))[0] for row in robot_parameters(robot)
    ]
    return with_parameters(robot, np.array(rows))


@cache
def motion(*, payload: bool = True, duration_s: float = 8.0, rate_hz: float = 250.0, noise_seed: int = 2) -> Recording:
    """Return a Panda with other links, friction and bias in motion, its torque and velocity a little noisy."""
    panda = Robot.load("panda")
    arm = other_arm(panda, 1)
    if payload:
        arm = arm.with_payload(*PAYLOAD)
    rng = np.random.default_rng(1)
    t = np.arange(0, duration_s, 1 / rate_hz)
    q, dq, ddq = (np.zeros((len(t), 7)) for _ in range(3))
    q += panda.home
    for hz in (0.25, 0.45, 0.8):
        w = 2 * np.pi * hz
        size, phase = 0.35 * rng.uniform(0.6, 1.0, 7) / (hz / 0.25), rng.uniform(0, 2 * np.pi, 7)
        q += size * np.sin(w * t[:, None] + phase)
        dq += size * w * np.cos(w * t[:, None] + phase)
        ddq -= size * w**2 * np.sin(w * t[:, None] + phase)
    rng = np.random.default_rng(noise_seed)
    dynamics = Dynamics(arm)
    tau = np.array([dynamics.inverse_dynamics(*row) for row in zip(q, dq, ddq, strict=True)])
    tau += BIAS + COULOMB * np.tanh(dq / 0.02) + VISCOUS * dq
    tau += rng.normal(0, 0.05, tau.shape)
    return Recording(t, {"q": q, "dq": dq + rng.normal(0, 1e-4, dq.shape), "tau": tau}, source="motion.csv")
