"""The wrench that explains an external torque."""

from __future__ import annotations

import functools
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tactful._njit import njit
from tactful.dynamics import Record
from tactful.errors import TactfulError
from tactful.estimation._config import WrenchConfig

Matrix = NDArray[np.float64]


@functools.cache
def wrench_dtype(n: int) -> np.dtype[np.void]:
    """Return the layout of the parameters, the scratch and the result of a wrench estimate for n joints."""
    m = min(n, 6)
    return np.dtype(
        [
            ("damped_below", "f8"),
            ("damping", "f8"),
            ("A", "f8", (m, m)),
            ("L", "f8", (m, m)),
            ("y", "f8", (m,)),
            ("sigma_bound", "f8"),  # of the Jacobian as it is, without damping
            ("damped", "i8"),
            ("F", "f8", (6,)),
        ],
        align=True,
    )


def wrench_record(n: int, config: WrenchConfig) -> Record:
    """Return room for a wrench estimate."""
    record: Any = np.zeros(1, wrench_dtype(n))
    record["damped_below"] = config.damped_below
    record["damping"] = config.damping
    return record  # type: ignore[no-any-return]


@njit(cache=True)
def _cholesky(A: Matrix, shift: float, L: Matrix) -> None:
    """Set L, lower, with L L^T = A + shift I."""
    m = A.shape[0]
    for i in range(m):
        for j in range(i + 1):
            total = A[i, j]
            if i == j:
                total += shift
            for k in range(j):
                total -= L[i, k] * L[j, k]
            if i == j:
                L[i, i] = np.sqrt(max(total, 1e-300))
            else:
                L[i, j] = total / L[j, j]


@njit(cache=True)
def _bound(L: Matrix, y: Matrix) -> float:
    """Return 1 / ||L^-1||_F, which is at most the smallest singular value of L and at least that over sqrt(m)."""
    m = L.shape[0]
    total = 0.0
    for c in range(m):
        for i in range(c, m):
            value = 1.0 if i == c else 0.0
            for k in range(c, i):
                value -= L[i, k] * y[k]
            y[i] = value / L[i, i]
            total += y[i] * y[i]
    return 1.0 / np.sqrt(total)  # type: ignore[no-any-return]


@njit(cache=True)
def solve_wrench(wrench: Any, J: Matrix, tau: Matrix) -> None:
    """Set F (6,) = pinv(J^T) tau, damped near singularities; J is (6, n), tau (n,)."""
    n = J.shape[1]
    A, L, y, F = wrench.A, wrench.L, wrench.y, wrench.F
    m = A.shape[0]
    tall = n >= 6
    trace = 0.0
    for i in range(m):
        for j in range(i + 1):
            total = 0.0
            if tall:
                for k in range(n):
                    total += J[i, k] * J[j, k]
            else:
                for k in range(6):
                    total += J[k, i] * J[k, j]
            A[i, j] = total
        trace += A[i, i]
    _cholesky(A, 1e-14 * trace, L)
    sigma = _bound(L, y)
    wrench.sigma_bound = sigma
    wrench.damped = sigma < wrench.damped_below
    if wrench.damped:
        ratio = sigma / wrench.damped_below
        _cholesky(A, wrench.damping * wrench.damping * (1.0 - ratio * ratio), L)
    for i in range(m):
        total = 0.0
        if tall:
            for k in range(n):
                total += J[i, k] * tau[k]
        else:
            total = tau[i]
        for k in range(i):
            total -= L[i, k] * y[k]
        y[i] = total / L[i, i]
    for i in range(m - 1, -1, -1):
        total = y[i]
        for k in range(i + 1, m):
            total -= L[k, i] * y[k]
        y[i] = total / L[i, i]
    for i in range(6):
        if tall:
            F[i] = y[i]
        else:
            total = 0.0
            for k in range(n):
                total += J[i, k] * y[k]
            F[i] = total


class Wrench(NamedTuple):
    """An external wrench and how far it can be trusted."""

    force_n: NDArray[np.float64]
    """Force on the robot (3,), base axes [N]."""
    moment_nm: NDArray[np.float64]
    """Moment about the frame's origin (3,), base axes [Nm]."""
    sigma_min: float
    """Smallest singular value of the Jacobian (in SI units, metres and radians mixed)."""
    damped: bool
    """Whether the solution is damped: then the force along the lost direction is too small."""


def external_wrench(J: ArrayLike, tau_ext: ArrayLike, config: WrenchConfig | None = None) -> Wrench:
    r"""Return the wrench at a frame that explains an external joint torque.

        F = (J^T)^+ tau_ext = (J J^T + lambda^2 I)^-1 J tau_ext,

    with the frame's Jacobian J (6, n): `Dynamics(robot).jacobian(q, frame)`. The paper prints J^+ tau_ext in (9)
    (doi:10.1109/RO-MAN53752.2022.9900800), whose dimensions do not fit; this is the pseudo-inverse of (2). With fewer
    than six joints it is the wrench of least norm.

    lambda is 0 but near a singularity: with the bound s = 1 / ||L^-1||_F, J J^T = L L^T, which lies between
    sigma_min / sqrt(6) and sigma_min, lambda^2 = damping^2 (1 - (s / damped_below)^2) where s < damped_below
    (Y. Nakamura, H. Hanafusa 1986, doi:10.1115/1.3143764, with s in place of the manipulability).

    Args:
        J: Jacobian (6, n) of the frame.
        tau_ext: external joint torque (n,) [Nm].
        config: the damping.

    Raises:
        TactfulError: if the shapes do not fit, or a number is not finite.
    """
    jacobian, torque = (np.require(x, np.float64, ["C", "W"]) for x in (J, tau_ext))
    if not jacobian.size or jacobian.shape[:-1] != (6,) or torque.shape != jacobian.shape[1:]:
        raise TactfulError(f"J has shape {jacobian.shape} and tau_ext {torque.shape}: they must be (6, n) and (n,)")
    if not (np.isfinite(jacobian).all() and np.isfinite(torque).all()):
        raise TactfulError("J or tau_ext has numbers that are not finite: skip this sample")
    record: Any = wrench_record(jacobian.shape[1], config or WrenchConfig())
    solve_wrench(record[0], jacobian, torque)
    F = record["F"][0]
    return Wrench(F[:3].copy(), F[3:].copy(), smallest_singular_value(jacobian), bool(record["damped"][0]))


def smallest_singular_value(J: Matrix) -> float:
    """Return the smallest singular value of a Jacobian (6, n)."""
    return float(np.linalg.svd(J, compute_uv=False)[-1])
