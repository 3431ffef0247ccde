"""What isolation is measured against: a threshold on each joint, and least squares for each link."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tactful.dynamics import Dynamics

Array = NDArray[np.float64]

THRESHOLD = 3.0
"""Of the first baseline, in standard deviations of the noise."""


def last_over_threshold(tau: Array, noise_nm: float) -> int:
    """Return the last joint whose torque exceeds the threshold: all joints before the contact feel it, none behind.

    Source: S. Haddadin, A. De Luca, A. Albu-Schaeffer 2017, doi:10.1109/TRO.2017.2723903.
    """
    over = np.flatnonzero(np.abs(tau) > THRESHOLD * noise_nm)
    return int(over[-1]) if len(over) else 0


def least_squares_link(dynamics: Dynamics, q: Array, tau: Array, noise_nm: float) -> int:
    """Return the link whose best wrench F explains the torque best: min |J^T F - tau|^2 / noise^2 + 2 rank(J).

    The charge for what a link can explain anyway is Akaike's; without it the last link always wins.
    """
    scores = []
    for link in range(dynamics.n):
        J = dynamics.jacobian_at(q, link, np.zeros(3))  # (6, n), of a point of the link that passes the base's origin
        F, _, rank, _ = np.linalg.lstsq(J.T, tau, rcond=1e-9)
        scores.append(float(np.sum((J.T @ F - tau) ** 2)) / noise_nm**2 + 2 * int(rank))
    return int(np.argmin(scores))
