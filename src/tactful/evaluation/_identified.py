"""The force that a recording's own external torque and Jacobian tell."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tactful.isolation import BiasTracker, identify_wrench
from tactful.monitor import Timeline
from tactful.recordings import Recording
from tactful.robots import Robot

Array = NDArray[np.float64]

SHARE = 0.0025
"""Standard deviation of hysteresis and bias of a joint's torque, relative to the joint's torque limit."""
UNKNOWN_NM = 0.1
"""The same where the arm is not known [Nm]."""


def identified_force(recording: Recording, timeline: Timeline, robot: Robot | None) -> Array | None:
    """Return the force at the tip (N, 3) by `identify_wrench`, its bias tracked and kept in contact [N].

    It stands in the axes of the recording's Jacobian. What a contact is, is what the monitor told.

    Args:
        recording: a recording with `tau_ext` and `jacobian`; for others, None is returned.
        timeline: what the monitor made of it.
        robot: the arm, whose torque limits weigh the joints; without it all count alike.
    """
    tau_ext, jacobian = recording.tau_ext, recording.channels.get("jacobian")
    if tau_ext is None or jacobian is None:
        return None
    n = tau_ext.shape[1]
    J = jacobian.reshape(-1, 6, n)
    known = robot is not None and robot.n == n and bool(np.isfinite(robot.torque_limit).all())
    noise = SHARE * robot.torque_limit if robot is not None and known else np.full(n, UNKNOWN_NM)
    covariance = np.diag(noise**2)
    touched = np.zeros(len(recording), dtype=bool)
    for event in timeline:
        end_s = timeline.end_s if event.end_s is None else event.end_s
        touched |= (recording.t >= event.detected_s) & (recording.t <= end_s)
    good = np.isfinite(np.column_stack([recording.t, tau_ext, jacobian])).all(axis=1)
    tracker = BiasTracker(n)
    force = np.full((len(recording), 3), np.nan)
    for k in np.flatnonzero(good):
        torque = tracker.update(float(recording.t[k]), tau_ext[k], bool(touched[k]))
        force[k] = identify_wrench(J[k], torque, covariance).force_n
    return force
