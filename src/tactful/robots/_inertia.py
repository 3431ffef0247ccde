"""Rigid-body inertia: joining bodies, and what makes a matrix an inertia."""

from __future__ import annotations

import numpy as np

from tactful.robots._frozen import Array


def joined_inertia(
    mass_a: float, com_a: Array, inertia_a: Array, mass_b: float, com_b: Array, inertia_b: Array
) -> tuple[float, Array, Array]:
    """Mass, centre of mass and inertia about it of two bodies that are fixed to each other, all in the same frame.

    I = I_a + I_b + m_a m_b / (m_a + m_b) (d.d 1 - d d^T) with d = com_a - com_b.

    Returns:
        The mass [kg], the centre of mass (3,) [m] and the inertia (3, 3) [kg m^2].
    """
    mass = mass_a + mass_b
    if mass == 0.0:
        return 0.0, com_a, inertia_a + inertia_b
    d = com_a - com_b  # (3,)
    steiner = mass_a * mass_b / mass * (d @ d * np.eye(3) - np.outer(d, d))  # (3, 3)
    return mass, (mass_a * com_a + mass_b * com_b) / mass, inertia_a + inertia_b + steiner


def inertia_problem(inertia: Array, *, allow_zero: bool = False) -> str | None:
    """Why a (3, 3) matrix cannot be the inertia of a rigid body about its centre of mass, or None.

    It has to be symmetric, its principal moments positive and none larger than the sum of the other two.
    """
    scale = float(np.abs(inertia).max())
    if not np.isfinite(scale):
        return "is not finite"
    if not np.allclose(inertia, inertia.T, rtol=0, atol=1e-9 * scale):
        return "is not symmetric"
    low, middle, high = np.linalg.eigvalsh(inertia)
    moments = f"principal moments {low:.3g}, {middle:.3g}, {high:.3g} kg m^2"
    if low < 0 or (low == 0 and not allow_zero):
        return f"must be positive definite, but has the {moments}"
    if high > (low + middle) * (1 + 1e-6):
        return f"breaks the triangle inequality: no rigid body has the {moments}"
    return None
