"""The force at a real, pressed end effector, sample by sample, from its external torque alone."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tactful import Recording
from tactful.isolation import BiasTracker, identify_wrench

Array = NDArray[np.float64]

SIGMA = np.diag([0.2] * 4 + [0.05] * 3) ** 2
"""Hysteresis and bias of this arm: larger at its large joints."""


@dataclass(frozen=True)
class Pad:
    """What the estimate and the sensor say."""

    force_n: Array  # (k, 3) axes of the pad
    truth_n: Array  # (k, 3) force/torque sensor
    contact: NDArray[np.bool_]  # (k,) as judged from the estimate


def pressed(path: Path, *, track: bool = True) -> Pad:
    """Identify the force over a recording; contact begins above 1 N and ends below half of its peak."""
    recording = Recording.read(path)
    assert recording.tau_ext is not None
    J = recording.channels["jacobian"].reshape(-1, 6, 7)  # (k, 6, 7)
    tracker = BiasTracker(7)
    force, contact = np.zeros((len(J), 3)), np.zeros(len(J), dtype=bool)
    touched, peak, released_s = False, 0.0, -np.inf
    for k, (t, tau) in enumerate(zip(recording.t, recording.tau_ext, strict=True)):
        torque = tracker.update(t, tau, touched) if track else tau
        estimate = identify_wrench(J[k], torque, SIGMA)
        force[k] = estimate.force_n
        if not touched and estimate.magnitude_n > 1.0 and t > released_s + 0.5:
            touched, peak = True, 0.0
        peak = max(peak, estimate.magnitude_n)
        if touched and estimate.magnitude_n < 0.5 * peak:
            touched, released_s = False, t
        contact[k] = touched
    return Pad(force, recording.channels["wrench_ft"][:, :3], contact)
