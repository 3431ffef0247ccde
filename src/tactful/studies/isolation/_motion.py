"""Contacts in motion: how soon after the onset the link is settled."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tactful.estimation import MomentumObserver, ObserverConfig
from tactful.studies.isolation._trials import NOISE_NM, Laboratory, Row

Array = NDArray[np.float64]

BANDWIDTHS_HZ = (15.0, 60.0)
AFTER_S = np.arange(0.005, 0.1525, 0.005)
"""When the link is asked for, after the onset [s]."""
RISE_S = (0.01, 0.03)
"""In which the force rises [s]."""
SPEED = 0.3
"""Largest joint speed, of the joint's limit."""
SENSOR_NM = 0.2
"""White noise of the measured torque at 1 kHz [Nm]."""
BIAS_NM = 0.08
"""What is wrong with the torque throughout a trial [Nm]; with the noise behind the observer's low-pass about 0.1 Nm."""
_STEP_S = 0.001
_BEFORE = 150
"""Samples before the onset."""


def motion(lab: Laboratory, _: str) -> list[Row]:
    """One contact on a moving arm, through the momentum observer at each bandwidth."""
    robot, rng, dynamics = lab.robot, lab.rng, lab.dynamics
    q0, true = lab.draw.posed_contact()
    limit = np.where(np.isfinite(robot.velocity_limit), robot.velocity_limit, 1.0)
    speed = SPEED * limit * rng.uniform(-1.0, 1.0, size=robot.n)
    w = 2 * np.pi * rng.uniform(0.2, 1.0, size=robot.n)
    t = (np.arange(_BEFORE + round(AFTER_S[-1] / _STEP_S) + 2) - _BEFORE) * _STEP_S  # (k,) the onset is at 0
    q = q0 + speed * np.sin(np.outer(t, w)) / w  # (k, n)
    dq = speed * np.cos(np.outer(t, w))
    ddq = -speed * w * np.sin(np.outer(t, w))
    rise = rng.uniform(*RISE_S)
    R, p = lab.draw.link_pose(q0, true.link)
    local = R.T @ (true.point_m - p)
    tau = np.empty_like(q)
    for k in range(len(t)):
        tau[k] = dynamics.inverse_dynamics(q[k], dq[k], ddq[k])
        share = min(max(t[k] / rise, 0.0), 1.0)
        if share > 0:
            R, p = lab.draw.link_pose(q[k], true.link)
            tau[k] -= share * dynamics.jacobian_at(q[k], true.link, p + R @ local)[:3].T @ true.force_n
    tau += SENSOR_NM * rng.normal(size=tau.shape) + BIAS_NM * rng.normal(size=robot.n)
    asked = _BEFORE + np.round(AFTER_S / _STEP_S).astype(int)  # (a,)
    rows = []
    for bandwidth_hz in BANDWIDTHS_HZ:
        r = MomentumObserver(robot, ObserverConfig(bandwidth_hz=bandwidth_hz)).run(t - t[0], q, dq, tau)  # (k, n)
        answers = [lab.isolators[NOISE_NM].locate(q[k], r[k]).link_index for k in asked]
        changes = np.flatnonzero(np.array(answers) != answers[-1])
        row: Row = {f"link_{i}": link for i, link in enumerate(answers)}
        row["true"] = true.link
        row["bandwidth_hz"] = bandwidth_hz
        row["settled_s"] = float(AFTER_S[changes[-1] + 1 if len(changes) else 0])
        rows.append(row)
    return rows
