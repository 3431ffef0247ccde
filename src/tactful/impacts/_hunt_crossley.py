"""The force of a compliant contact, and the restitution that it makes."""

from __future__ import annotations

import math
from typing import Annotated, Any, Literal

from pydantic import Field, NonNegativeFloat, PositiveFloat

from tactful._njit import njit
from tactful.config import Config
from tactful.errors import TactfulError

Law = Literal["plain", "exponential"]

_LEAST_RESTITUTION = 1e-3
"""Below, the damping that it takes outgrows every step of an integration."""


class CompliantContactConfig(Config):
    r"""A compliant contact with Coulomb friction, see `contact_force` and `friction_force`."""

    stiffness: PositiveFloat = 2e7
    """k of the force k x^p, x the penetration [N/m^p]."""
    exponent: Annotated[float, Field(ge=1)] = 1.5
    """p; 1.5 is Hertz's contact of a sphere."""
    restitution: Annotated[float, Field(ge=_LEAST_RESTITUTION, le=1)] = 0.05
    """Speed after over speed before an impact at `speed_m_s` of a free body on a fixed surface."""
    speed_m_s: PositiveFloat = 0.3
    """Speed of approach at which `restitution` holds; slower impacts rebound with a larger share [m/s]."""
    friction: NonNegativeFloat = 0.0
    """Coefficient of Coulomb friction mu."""
    friction_speed_m_s: PositiveFloat = 0.01
    """Sliding speed at which the friction has 76 % of mu F_n [m/s]."""

    @property
    def damping_s_m(self) -> float:
        """The damping d of the exponential law that gives the restitution [s/m]."""
        return damping_for(self.restitution, self.speed_m_s)


@njit(cache=True)
def contact_force(stiffness: float, exponent: float, damping: float, x: float, v: float) -> float:
    r"""Return the normal force at the penetration x [m] that grows with the speed v [m/s], after Hunt and Crossley [N].

    F = k x^p (1 + d v) for v >= 0, and k x^p e^{d v} for v < 0, for x > 0: the exponential keeps the force from pulling
    where the plain law, 1 + d v throughout, would.

    Sources: K. Hunt, F. Crossley 1975, doi:10.1115/1.3423596; A. Carvalho, J. Martins 2019,
    doi:10.1016/j.mechmachtheory.2019.03.028.
    """
    if x <= 0.0:
        return 0.0
    spring = stiffness * x * math.sqrt(x) if exponent == 1.5 else stiffness * x**exponent
    return spring * (1.0 + damping * v) if v >= 0.0 else spring * math.exp(damping * v)


@njit(cache=True)
def friction_force(friction: float, speed: float, normal: float, v_t: float) -> float:
    """Return the regularized Coulomb friction -mu F_n tanh(v_t / speed) on a body that slides with v_t [N]."""
    return -friction * normal * math.tanh(v_t / speed)


def restitution(damping_s_m: float, speed_m_s: float, law: Law = "exponential") -> float:
    r"""Return the coefficient of restitution of a free body on a fixed surface, exactly.

    With z = d v_0 and W_0 the principal branch of the Lambert function,

        plain:        e = (1 + W_0(-(1 + z) exp(-(1 + z)))) / z
        exponential:  e = (1 + W_0((z - ln(1 + z) - 1) / exp(1))) / z

    for any stiffness, exponent and mass: along the way, m v dv / f(v) = -k x^p dx, and the integral of the left side
    over the compression equals that over the expansion.

    Args:
        damping_s_m: d [s/m].
        speed_m_s: speed of approach v_0 [m/s].
        law: `contact_force` is the exponential one.

    Raises:
        TactfulError: if a number is negative.
    """
    from scipy.special import lambertw

    if not (damping_s_m >= 0 and speed_m_s >= 0):
        raise TactfulError(f"restitution: damping {damping_s_m} and speed {speed_m_s} must not be negative")
    z = damping_s_m * speed_m_s
    if z < 1e-4:  # both series begin so; the quotient would lose its digits
        return 1.0 - 2.0 / 3.0 * z
    if law == "plain":
        argument = -(1.0 + z) * math.exp(-(1.0 + z))
    else:
        argument = (z - math.log1p(z) - 1.0) / math.e
    return float((1.0 + lambertw(argument).real) / z)


def damping_for(e: float, speed_m_s: float, law: Law = "exponential") -> float:
    """Return the damping d that gives the restitution e at the speed of approach, the inverse of `restitution` [s/m].

    Raises:
        TactfulError: if e is not in [0.001, 1], or the speed is not positive.
    """
    from scipy.optimize import brentq

    if not (_LEAST_RESTITUTION <= e <= 1 and speed_m_s > 0):
        allowed = f"e must be in [{_LEAST_RESTITUTION}, 1] and the speed positive"
        raise TactfulError(f"damping: restitution {e} at {speed_m_s} m/s; {allowed}")
    if e == 1.0:
        return 0.0

    def excess(log_z: float) -> float:
        return restitution(math.exp(log_z), 1.0, law) - e

    log_z: Any = brentq(excess, math.log(1e-12), math.log(1e6), xtol=1e-13)
    return math.exp(log_z) / speed_m_s
