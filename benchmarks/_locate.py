"""How long it takes to locate a contact."""

from __future__ import annotations

import time

import numpy as np

from tactful import Robot
from tactful.isolation import Isolator

_CALLS = 2000


def measure_locate(robot: Robot) -> dict[str, float]:
    """Return the mean time on the processor that `Isolator.locate` takes [us].

    Torques of 5 Nm up to a drawn link in drawn poses, with noise; the first call, which compiles, is left out.
    """
    rng = np.random.default_rng(0)
    isolator = Isolator(robot)
    low, high = np.maximum(robot.lower, -np.pi), np.minimum(robot.upper, np.pi)
    q = rng.uniform(low, high, (_CALLS, robot.n))
    tau_ext = rng.normal(0.0, 5.0, (_CALLS, robot.n))
    links = rng.integers(robot.n // 2, robot.n, _CALLS)
    tau_ext[np.arange(robot.n) > links[:, None]] = 0.0
    tau_ext += rng.normal(0.0, 0.1, tau_ext.shape)
    isolator.locate(q[0], tau_ext[0])
    begin = time.process_time()
    for each, torque in zip(q, tau_ext, strict=True):
        isolator.locate(each, torque)
    return {"locate_us": 1e6 * (time.process_time() - begin) / _CALLS}
