"""A loop at 1 kHz: what its steps take."""

from __future__ import annotations

import gc
import time
from typing import Any

import numpy as np

from benchmarks._motion import RATE_HZ, swing
from tactful import Monitor, Robot


def measure_loop(robot: Robot, duration_s: float) -> dict[str, Any]:
    """Return quantiles of the time that `Monitor.update` takes when it is called every millisecond [us].

    `cpu` has those of the time on the processor, which is without the time that the system gives to other processes.
    The loop sleeps between samples, so the caches are as cold as they are on a robot. What was made before the loop is
    frozen, so the garbage collector does not look at it again.
    """
    recording = swing(robot, duration_s, np.random.default_rng(0))
    q, dq, tau = (recording.channels[name] for name in ("q", "dq", "tau"))
    monitor = Monitor(robot)
    monitor.warm_up()
    taken, cpu = np.empty((2, len(recording.t)))
    gc.collect()
    gc.freeze()
    try:
        start = time.perf_counter()
        for k, t in enumerate(recording.t.tolist()):
            time.sleep(max(0.0, start + k / RATE_HZ - time.perf_counter()))
            begin_cpu, begin = time.thread_time(), time.perf_counter()
            monitor.update(t, q[k], dq[k], tau[k])
            taken[k] = time.perf_counter() - begin
            cpu[k] = time.thread_time() - begin_cpu
    finally:
        gc.unfreeze()
    return _quantiles_us(taken) | {"cpu": _quantiles_us(cpu)}


def _quantiles_us(seconds: Any) -> dict[str, Any]:
    quantiles = np.quantile(seconds, (0.5, 0.99, 0.999, 1.0)) * 1e6
    return dict(zip(("p50", "p99", "p99_9", "max"), quantiles.tolist(), strict=True))
