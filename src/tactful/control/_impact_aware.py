"""Impedance control through an impact: which reference is followed, and what is left free in contact."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydantic import NonNegativeFloat, NonNegativeInt

from tactful._njit import njit
from tactful.config import Config

Array = NDArray[np.float64]

ANTE, INTERIM, POST = 0, 1, 2
"""Phases of a motion with an impact: before it, until all points have landed, and after."""


class ImpactControlConfig(Config):
    r"""Impedance control in the vertical plane, with x along the surface, y along its normal, and the angle.

    Before the impact u = M_r(q) \ddot q_ff + C \dot q + g + J^T (K_p (x_d - x) + K_d (\dot x_d - \dot x)) follows the
    ante-impact reference; from the first detected impact on the post-impact one, with a constant force along the
    normal in place of its feedback.

    Sources: B. Proper et al. 2023, https://hal.science/hal-03974694v3, Sec. III-A (which gives no figures); interim
    phase: J. van Steen et al. 2022, doi:10.23919/ACC53348.2022.9867702.
    """

    stiffness: tuple[NonNegativeFloat, NonNegativeFloat, NonNegativeFloat] = (600.0, 600.0, 10.0)
    """K_p [N/m, N/m, Nm/rad]."""
    damping: tuple[NonNegativeFloat, NonNegativeFloat, NonNegativeFloat] = (60.0, 60.0, 1.0)
    """K_d [Ns/m, Ns/m, Nms/rad]."""
    normal_force_n: float = -80.0
    """Constant force along the normal after the impact; negative presses onto the surface [N]."""
    interim_s: NonNegativeFloat = 0.0
    """Time since the latest detected impact during which the velocity is not fed back: between the first and the last
    point that lands it jumps in ways that no reference holds [s]."""
    friction: NonNegativeFloat = 0.0
    """Coefficient of the contact's friction that is fed forward, mu |F_n| along the sliding of the reference."""
    delay_samples: NonNegativeInt = 0
    """Samples between a measurement and the torque that follows from it."""


@njit(cache=True)
def impact_aware_force(control: Any, phase: int, x: Array, dx: Array, x_d: Array, dx_d: Array, F: Array) -> None:
    """Set the force F (3,) on the coordinates (along the surface, along the normal, angle) in a phase of the motion."""
    for i in range(3):
        F[i] = control.stiffness[i] * (x_d[i] - x[i])
        if phase != INTERIM:
            F[i] += control.damping[i] * (dx_d[i] - dx[i])
    if phase != ANTE:
        F[1] = control.normal_force
        F[0] -= control.friction * control.normal_force * np.tanh(dx_d[0] / 0.01)
