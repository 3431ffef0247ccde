"""How hard: the wrench at a known point or frame, with what is not known of it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import Field, PositiveFloat
from scipy.special import ndtri

from tactful.config import Config
from tactful.estimation._wrench import smallest_singular_value
from tactful.isolation._location import NOT_POSITIVE, Array, IsolationError


class WrenchPrior(Config):
    """What a contact's wrench is expected to be, in physical units, see `identify_wrench`."""

    force_n: PositiveFloat = 20.0
    """Standard deviation of each component of the force [N]."""
    moment_nm: PositiveFloat = 0.3
    """Standard deviation of each component of the moment: a touch makes little of it about its own point [Nm]."""
    noise_nm: PositiveFloat = 0.1
    """Standard deviation of tau_ext where no covariance is given [Nm]."""
    coverage: Annotated[float, Field(gt=0.0, lt=1.0)] = 0.9
    """Probability that an interval holds the truth."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class WrenchEstimate:
    """A wrench from the environment on the robot and how far it can be trusted."""

    force_n: Array
    """(3,), axes of the Jacobian [N]."""
    moment_nm: Array
    """(3,), about the Jacobian's point [Nm]."""
    covariance: Array
    """(6, 6) of force and moment."""
    interval: Array
    """(6, 2) what holds each component with the probability `coverage`."""
    magnitude_n: float
    """Magnitude of the force [N]."""
    magnitude_interval_n: tuple[float, float]
    """What holds the magnitude with the probability `coverage` [N]."""
    observed: NDArray[np.bool_]
    """(6,) whether the torque tells the component: its variance is below a quarter of the prior's."""
    sigma_min: float
    """Smallest singular value of the Jacobian (in SI units, metres and radians mixed)."""


def identify_wrench(
    J: ArrayLike, tau_ext: ArrayLike, covariance: ArrayLike | None = None, prior: WrenchPrior | None = None
) -> WrenchEstimate:
    r"""Return the wrench F = (f, m) at a point that explains an external joint torque, tau_ext = J^T F + noise.

    With F ~ N(0, W), W = diag(force_n^2, moment_nm^2), and the noise's covariance Sigma,

        F = W J (J^T W J + Sigma)^-1 tau_ext,    P = W - W J (J^T W J + Sigma)^-1 J^T W.

    Near a singularity the lost direction returns to the prior, and its interval says so; nothing is damped.

    Args:
        J: (6, n) Jacobian of the point, linear above angular: `Dynamics.jacobian_at(q, link, point)` of a located
            contact, or `Dynamics.jacobian(q, frame)`.
        tau_ext: (n,) [Nm], without its bias, see `BiasTracker`.
        covariance: (n, n) Sigma of all errors of tau_ext [Nm^2]; by default that of `noise_nm`.
        prior: what is expected.

    Raises:
        IsolationError: if the shapes do not fit, a number is not finite, or the covariance is not positive definite.
    """
    prior = prior or WrenchPrior()
    jacobian, torque = np.asarray(J, dtype=np.float64), np.asarray(tau_ext, dtype=np.float64)
    if jacobian.ndim != 2 or jacobian.shape[0] != 6 or torque.shape != jacobian.shape[1:] or not torque.size:
        raise IsolationError(
            "J", f"has shape {jacobian.shape} and tau_ext {torque.shape}; they must be (6, n) and (n,)"
        )
    n = len(torque)
    Sigma = prior.noise_nm**2 * np.eye(n) if covariance is None else np.asarray(covariance, dtype=np.float64)
    if Sigma.shape != (n, n):
        raise IsolationError("covariance", f"has shape {Sigma.shape}; {n} joints need {(n, n)}")
    for name, array in (("J", jacobian), ("tau_ext", torque), ("covariance", Sigma)):
        if not np.isfinite(array).all():
            raise IsolationError(name, "has numbers that are not finite: skip this sample")
    W = np.repeat([prior.force_n**2, prior.moment_nm**2], 3)  # (6,) diagonal
    WJ = W[:, None] * jacobian  # (6, n)
    try:
        whitener = np.linalg.inv(np.linalg.cholesky(jacobian.T @ WJ + Sigma))  # (n, n)
        np.linalg.cholesky(Sigma)
    except np.linalg.LinAlgError:
        raise IsolationError("covariance", NOT_POSITIVE) from None
    half = WJ @ whitener.T  # (6, n)
    F = half @ (whitener @ torque)
    P = np.diag(W) - half @ half.T
    variance = np.maximum(np.diag(P), 0.0)  # (6,)
    z = float(ndtri(0.5 + 0.5 * prior.coverage))
    size = float(np.linalg.norm(F[:3]))
    along = F[:3] / size if size > 0 else np.zeros(3)
    deviation = (
        float(np.sqrt(np.maximum(along @ P[:3, :3] @ along, 0.0))) if size > 0 else float(np.sqrt(np.max(variance[:3])))
    )
    return WrenchEstimate(
        force_n=F[:3],
        moment_nm=F[3:],
        covariance=P,
        interval=F[:, None] + z * np.sqrt(variance)[:, None] * [-1.0, 1.0],
        magnitude_n=size,
        magnitude_interval_n=(max(size - z * deviation, 0.0), size + z * deviation),
        observed=variance < 0.25 * W,
        sigma_min=smallest_singular_value(jacobian),
    )
