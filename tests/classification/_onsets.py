"""Onsets by hand: an arm at its home pose that moves steadily and is touched."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from tactful import Robot
from tactful.classification import Onset
from tactful.dynamics import Dynamics

Array = NDArray[np.float64]

PANDA = Robot.load("panda")
DYNAMICS = Dynamics(PANDA)


def moving(velocity_m_s: Any) -> Array:
    """Return the joint velocity (n,) that moves the tip so, with the least kinetic energy [rad/s]."""
    J, M = DYNAMICS.jacobian(PANDA.home)[:3], DYNAMICS.mass_matrix(PANDA.home)
    MJ = np.linalg.solve(M, J.T)
    return np.asarray(MJ @ np.linalg.solve(J @ MJ, np.asarray(velocity_m_s, dtype=np.float64)))


def touched(torque_nm: Any, dq: Any, after: Any = None, *, rise_s: float = 0.01, **fields: Any) -> Onset:
    """Return what is known 20 ms after a detection, of a contact with this torque on an arm that moves with dq.

    From the onset on, it moves with `after`.
    """
    rate_hz, before, since = 1000.0, 300, round(1000 * rise_s) + 20
    y = np.asarray(torque_nm, dtype=np.float64)
    rows = before + since + 1
    t = np.arange(rows) / rate_hz
    velocity = np.tile(np.asarray(dq, dtype=np.float64), (rows, 1))
    if after is not None:
        velocity[before + 1 :] = after
    q = PANDA.home + np.cumsum(velocity, axis=0) / rate_hz
    q -= q[-1] - PANDA.home
    J = DYNAMICS.jacobian(PANDA.home)
    share = np.clip((np.arange(rows) - before) / since, 0, 1)[:, None]
    known: dict[str, Any] = {
        "rate_hz": rate_hz,
        "t": t,
        "force_n": share * np.linalg.lstsq(J.T, y, rcond=None)[0][:3],
        "moment_nm": np.zeros((rows, 3)),
        "velocity_m_s": velocity @ J[:3].T,
        "tau_ext_nm": share * y,
        "index": before,
        "directions": np.ones(3, dtype=bool),
        "in_collision": False,
        "torque_change_nm": y,
        "mean_force_change_n": np.linalg.lstsq(J.T, y, rcond=None)[0][:3],
        "torque_covariance_nm2": 0.04**2 * np.eye(7),
        "detected_s": float(t[-21]),
        "q_rad": q,
        "jacobian": J,
        "mass_matrix": DYNAMICS.mass_matrix(PANDA.home),
    }
    return Onset(**(known | fields))


def at_tip(force_n: Any) -> Array:
    """Return the torque (n,) of a force at the tip."""
    return np.asarray(DYNAMICS.jacobian(PANDA.home)[:3].T @ np.asarray(force_n, dtype=np.float64))
