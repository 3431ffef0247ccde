"""Where a contact is, and what is known of one."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tactful.errors import TactfulError
from tactful.robots import Robot

Array = NDArray[np.float64]
Region = Literal["proximal", "middle", "distal"]

NOT_POSITIVE = "is not positive definite: add the variance of the noise to its diagonal"
_FIRST_LINK: dict[Region, int] = {"proximal": 0, "middle": 3, "distal": 5}


class IsolationError(TactfulError):
    """An input of the isolation that does not fit the robot.

    Attributes:
        argument: The argument at fault.
    """

    def __init__(self, argument: str, problem: str) -> None:
        """Name the argument and what is wrong with it."""
        self.argument = argument
        super().__init__(f"{argument} {problem}")


def region_of(link: int) -> Region:
    """Return the region of a link by its index: what the torques of the joints before it can tell.

    Up to the third joint (`proximal`) they do not even determine the force; with four or five (`middle`) they determine
    the force and leave a curve of points; from the sixth on (`distal`) they determine force and point.
    """
    return "proximal" if link < 3 else "middle" if link < 5 else "distal"


def region_probabilities(link_probabilities: Array) -> dict[Region, float]:
    """Return the probability of each region that the arm has, from that of its links (n,)."""
    starts = {region: first for region, first in _FIRST_LINK.items() if first < len(link_probabilities)}
    return dict(zip(starts, np.add.reduceat(link_probabilities, list(starts.values())).tolist(), strict=True))


@dataclass(frozen=True, eq=False, kw_only=True)
class KnownContact:
    """A contact that is known when another one is looked for, such as at the tip.

    It explains J^T F of the torque, and J^T (P + drift^2 I) J is not known of that, with J at the point.
    """

    link: int
    """Index of the touched link."""
    point_m: Array
    """Where it is (3,), base axes [m]."""
    wrench: Array
    """Force and moment on the robot about that point (6,), base axes [N, Nm]."""
    covariance: Array
    """Covariance P of the wrench (6, 6)."""
    drift_n: float = 0.0
    """Standard deviation of what each component of the force has changed by since it was estimated [N]."""

    @classmethod
    def at_frame(
        cls, robot: Robot, q: ArrayLike, wrench: ArrayLike, covariance: ArrayLike, *, frame: str | None = None,
        drift_n: float = 0.0,
    ) -> KnownContact:  # fmt: skip
        """Return a contact with this wrench and covariance at a frame of the robot, the tip by default.

        Raises:
            UnknownFrameError: if there is no such frame.
        """
        from tactful.dynamics import Dynamics

        name = frame or robot.tip
        point = Dynamics(robot).pose(q, name)[1]
        return cls(
            link=robot.frames[name].link,
            point_m=point,
            wrench=np.asarray(wrench, dtype=np.float64),
            covariance=np.asarray(covariance, dtype=np.float64),
            drift_n=drift_n,
        )


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class ContactLocation:
    """Where on the arm a contact is and how hard, as far as the external joint torque tells."""

    link: str
    """The most probable link."""
    link_index: int
    """Its index."""
    confidence: float
    """Its probability."""
    link_probabilities: Array
    """Probability of each link (n,)."""
    region: Region
    """The most probable region, see `region_of`."""
    region_confidence: float
    """Its probability."""
    ambiguous: bool
    """Whether no link is sure (`IsolationConfig.sure`)."""
    point_m: Array | None
    """The contact point (3,) on that link, base axes [m]; None where the torque leaves a set of points."""
    point_covariance: Array | None
    """Its covariance (3, 3) [m^2]."""
    candidates_m: Array
    """The points (k, 3) of that link that together hold the contact with the probability `coverage`, base axes, the
    densest first [m]. They are a grid: the surface between them belongs to them."""
    candidates_p: Array
    """Probability of each of them (k,), given the link."""
    force_n: Array
    """Force on the robot (3,), base axes [N]."""
    force_covariance: Array
    """Its covariance (3, 3) [N^2], over all that is not known: point, magnitude, noise."""
    magnitude_n: float
    """Magnitude of the force [N]."""
    magnitude_interval_n: tuple[float, float]
    """Interval that holds the magnitude with the probability `coverage` [N]."""
    signal: float
    """Squared Mahalanobis distance of the torque from none."""
    misfit: float
    """Squared Mahalanobis distance of the torque from the best single contact."""
    explained: float
    """Probability of a misfit so large or larger, if there is a single contact (chi-square)."""
    several: bool
    """Whether one contact does not explain the torque (`IsolationConfig.false_misfit`)."""

    def known(self, *, drift_n: float = 0.0) -> KnownContact:
        """Return the contact as one that is known when another is looked for.

        The best point stands for all candidates; what their distance from it makes of the force is in the covariance.
        """
        point = self.candidates_m[0]
        spread = (self.candidates_m - point).T @ (self.candidates_p[:, None] * (self.candidates_m - point))
        x, y, z = self.force_n
        cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])  # [f]: the moment is (x - point) x f
        covariance = np.zeros((6, 6))
        covariance[:3, :3] = self.force_covariance
        covariance[3:, 3:] = cross @ spread @ cross.T
        wrench = np.concatenate([self.force_n, np.zeros(3)])
        return KnownContact(link=self.link_index, point_m=point, wrench=wrench, covariance=covariance, drift_n=drift_n)
