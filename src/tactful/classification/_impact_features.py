"""What an impact looked like at the tool, in quantities that mean something."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from tactful.classification._aim_aware_result import AimAwareResult
from tactful.errors import TactfulError
from tactful.impacts import ImpactPlan
from tactful.robots import Robot

Array = NDArray[np.float64]

_PIECES = 5
_PARTS = [f"{100 * k // _PIECES}-{100 * (k + 1) // _PIECES}" for k in range(_PIECES)]

IMPACT_FEATURES: Mapping[str, str] = MappingProxyType(
    {
        "tilt_1": "rotation of the tool about the first axis in the surface, at the verdict [deg]",
        "tilt_2": "the same about the second axis [deg]",
        "tilt": "its magnitude [deg]",
        "lead": "time of the first impact after the planned one [s]",
        "spacing": "longest time between two impacts [s]",
        "impacts": "number of impacts before the verdict",
        "first_normal": "place of the tool at the first impact against the plan, along the normal [m]",
        "first_slide": "the same in the surface, along its first axis [m]",
        "end_normal": "place of the tool at the verdict, along the normal [m]",
        "end_slide": "the same in the surface, along its first axis [m]",
        **{
            f"{name}_{k}": f"mean {what} against the plan, {part} % of xi after the first impact [{unit}]"
            for name, what, unit in (
                ("normal", "velocity of the tool along the normal", "m/s"),
                ("slide", "velocity of the tool in the surface, along its first axis", "m/s"),
                ("turn_1", "angular velocity about the first axis in the surface", "rad/s"),
                ("turn_2", "angular velocity about the second axis in the surface", "rad/s"),
            )
            for k, part in enumerate(_PARTS)
        },
        "strength": "logarithm of the largest rate of the residual (Euclidean norm of the joints) [Nm/s]",
    }
)
"""The features of an impact in their order, and what they are. The first axis in the surface is the base axis that lies
flattest in it, the second one completes a right-handed frame (first axis, normal, second axis)."""


@dataclass(frozen=True, slots=True, eq=False)
class ImpactFeatures:
    """The features of one impact.

    Attributes:
        values: in the order of `IMPACT_FEATURES`.
        tilt_deg: rotation vector (3,) of the tool against the plan at the verdict, without its part about the normal,
            base axes [deg]. Where the tool lies flat on the surface by then, that is how the surface is inclined
            against the planned one.
    """

    values: Array
    tilt_deg: Array

    @property
    def inclination_deg(self) -> float:
        """The magnitude of the tilt, with the sign of its largest component [deg]."""
        largest = int(np.argmax(np.abs(self.tilt_deg)))
        return float(np.linalg.norm(self.tilt_deg) * np.sign(self.tilt_deg[largest]))


def impact_features(result: AimAwareResult, plan: ImpactPlan, robot: Robot) -> ImpactFeatures:
    """Return what an impact looked like at the tool, by the Jacobian at the planned configuration.

    Joint errors are small, so their first order does: the tilt of 8 deg is told to 0.1 deg.

    Args:
        result: what the classifier found; there has to be an impact in it.
        plan: with at least one contact point, whose link is the tool and whose normal is the surface's.
        robot: the arm.

    Raises:
        TactfulError: if there was no impact, or the plan has no contact points.
    """
    if not result.judged:
        raise TactfulError(f"the impact is {result.verdict!r}: there was none whose features could be told")
    if not plan.contacts:
        raise TactfulError("the impact plan has no contact points: give it some, they tell the tool and the surface")
    J, (n, a, b) = plan.at_tool(robot)
    rows = np.stack([n @ J[:3], a @ J[:3], a @ J[3:], b @ J[3:]])  # (4, n) normal, slide, turn 1, turn 2
    error = np.nan_to_num(result.mean_error_rad_s) @ rows.T  # (10, 4)
    pieces = error.reshape(_PIECES, -1, 4).mean(axis=1)  # (5, 4)
    rotation = J[3:] @ result.q_end_rad
    rotation -= (rotation @ n) * n
    tilt_deg = np.degrees(rotation)
    values = [
        tilt_deg @ a,
        tilt_deg @ b,
        np.linalg.norm(tilt_deg),
        result.impact_s[0] - plan.t_d_s,
        result.spacing_s,
        result.judged,
        *(rows[:2] @ result.q_first_rad),
        *(rows[:2] @ result.q_end_rad),
        *pieces.T.ravel(),
        np.log1p(np.linalg.norm(result.peak_rate_nm_s)),
    ]
    return ImpactFeatures(np.array(values, dtype=np.float64), tilt_deg)
