"""The force of a compliant contact."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from tactful.config import ConfigError
from tactful.errors import TactfulError
from tactful.impacts import CompliantContactConfig, contact_force, damping_for, friction_force, restitution
from tactful.impacts._hunt_crossley import Law


def _bounce(law: Law, damping: float, exponent: float, mass: float, stiffness: float) -> float:
    """Integrate a free body on a fixed surface until it leaves, and return speed after over speed before."""

    def slope(t: float, s: np.ndarray) -> list[float]:
        if law == "exponential":
            force = contact_force(stiffness, exponent, damping, s[0], s[1])
        else:
            force = stiffness * max(s[0], 0.0) ** exponent * (1 + damping * s[1])
        return [s[1], -force / mass]

    def leaves(t: float, s: np.ndarray) -> float:
        return float(s[0])

    leaves.terminal, leaves.direction = True, -1.0  # type: ignore[attr-defined]
    way = solve_ivp(slope, (0, 10), [1e-14, 0.3], events=leaves, rtol=1e-10, atol=1e-16, method="LSODA")
    return float(-way.y[1, -1] / 0.3)


@pytest.mark.parametrize("law", ["plain", "exponential"])
@pytest.mark.parametrize(("damping", "exponent", "mass"), [(1.0, 1.5, 2.0), (10.0, 1.0, 0.5), (218.0, 1.5, 3.0)])
def test_restitution_is_exact(law: Law, damping: float, exponent: float, mass: float) -> None:
    """The closed form agrees with the integration, whatever mass, stiffness and exponent are."""
    assert restitution(damping, 0.3, law) == pytest.approx(_bounce(law, damping, exponent, mass, 1e6), abs=1e-7)


@pytest.mark.parametrize("law", ["plain", "exponential"])
@pytest.mark.parametrize("e", [0.001, 0.05, 0.3, 0.9, 0.99999, 1.0])
def test_damping_is_the_inverse(law: Law, e: float) -> None:
    """A restitution is what is known of a contact; its damping is what the simulation needs."""
    assert restitution(damping_for(e, 0.4, law), 0.4, law) == pytest.approx(e, abs=1e-8)


def test_series_meets_the_closed_form() -> None:
    """For hardly any damping the closed form loses its digits."""
    for law in ("plain", "exponential"):
        assert restitution(0.99e-4, 1.0, law) == pytest.approx(restitution(1.01e-4, 1.0, law), abs=2e-6)  # type: ignore[arg-type]


def test_the_assumed_contact() -> None:
    """Restitution 0.05 at 0.3 m/s is a damping of 218 s/m."""
    assert CompliantContactConfig().damping_s_m == pytest.approx(218.5, abs=0.1)


def test_never_pulls_and_is_continuous() -> None:
    """A contact that pulls would hold the arm on the surface."""
    speeds = np.linspace(-1, 1, 201)
    forces = np.array([contact_force(2e7, 1.5, 218.0, 1e-4, v) for v in speeds])
    assert (forces >= 0).all()
    assert (np.diff(forces) > 0).all()
    assert contact_force(2e7, 1.5, 218.0, 1e-4, -1e-12) == pytest.approx(2e7 * 1e-6)
    assert contact_force(2e7, 1.5, 218.0, -1e-4, 1.0) == 0.0
    assert contact_force(2e7, 2.0, 0.0, 1e-2, 1.0) == pytest.approx(2e3)


def test_friction_opposes_sliding() -> None:
    """Its regularized form stays below mu F_n and changes sign with the sliding."""
    assert friction_force(0.2, 0.01, 100.0, 1.0) == pytest.approx(-20.0)
    assert friction_force(0.2, 0.01, 100.0, -0.01) == pytest.approx(20 * np.tanh(1))
    assert friction_force(0.2, 0.01, 100.0, 0.0) == 0.0


def test_what_cannot_be_is_refused() -> None:
    """No contact rebounds faster than it came."""
    with pytest.raises(TactfulError, match="restitution"):
        restitution(-1.0, 0.3)
    with pytest.raises(TactfulError, match=r"restitution 1\.1"):
        damping_for(1.1, 0.3)
    with pytest.raises(ConfigError, match="restitution"):
        CompliantContactConfig(restitution=1.1)
