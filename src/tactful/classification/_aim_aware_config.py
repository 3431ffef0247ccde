"""Settings of the aim-aware classifier, and the published ones."""

from __future__ import annotations

from typing import Annotated, Any, Literal, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from tactful.config import Config, ConfigError, per_joint
from tactful.detection import ImpactConfig

Positive = Annotated[float, Field(gt=0)]
NonNegative = Annotated[float, Field(ge=0)]
Table1 = Literal["strict", "medium", "wide"]
Table2 = Literal["strict", "wide"]

_TABLE_1: dict[str, dict[str, float]] = {
    "strict": {"m_max": 10, "m_c": 10, "a_per_s": 30, "epsilon_rad": 0.042, "e_m_rad_s": 0.033},
    "medium": {"m_max": 15, "m_c": 15, "a_per_s": 18, "epsilon_rad": 0.067, "e_m_rad_s": 0.1},
    "wide": {"m_max": 15, "m_c": 15, "a_per_s": 18, "epsilon_rad": 0.115, "e_m_rad_s": 0.236, "zeta_s": 0.11},
}
_TABLE_2: dict[str, dict[str, float]] = {
    "strict": {"m_max": 13, "m_c": 5, "a_per_s": 19, "epsilon_rad": 0.12, "e_m_rad_s": 0.18},
    "wide": {"m_max": 13, "m_c": 5, "a_per_s": 19, "epsilon_rad": 0.15, "e_m_rad_s": 0.2},
}


class AimAwareConfig(Config):
    """The aim-aware classifier, see `AimAware`; symbols as in the paper."""

    variant: Literal["corrected", "literal"] = "corrected"
    """"literal" is Algorithm 1 as it is printed, see `AimAware`."""
    envelope: bool = True
    """Whether the velocity error is judged by its envelope, or as it is: a baseline."""
    bandwidth_hz: Positive = 8.0
    """K_O / (2 pi) of the residual in which a `Monitor` looks for impacts; a low one parts them from noise better, as
    the decay of r goes with K_O^2 and its peak with K_O. K_O is not published [Hz]."""
    impact: ImpactConfig = ImpactConfig()
    """The detection of impacts."""
    m_max: Annotated[int, Field(ge=0)] = 15
    """Longest window of the envelope [samples]."""
    m_c: Annotated[int, Field(ge=0)] = 15
    """Samples after an impact before its envelope is judged."""
    a_per_s: Positive = 18.0
    """Decay rate a of the envelope [1/s]."""
    epsilon_rad: Positive = 0.067
    """Largest distance of the configuration at an impact from the planned one (Euclidean norm) [rad]."""
    zeta_s: Positive = 0.1
    """Largest difference between the time of an impact and the planned one [s]."""
    iota_s: Positive = 0.1
    """Largest time between two impacts [s]."""
    e_m_rad_s: NonNegative | tuple[NonNegative, ...] = 0.1
    """Margin on the envelope, for all joints or one each [rad/s]. Paper: one for all, printed in rad."""
    tilt_deg: Positive | None = None
    """Largest rotation of the tool against the plan at the verdict, for a plan that knows it; None leaves it out.
    Paper: not there [deg]."""
    xi_s: Positive = 0.1
    """Time from an impact to the verdict [s]."""
    xi_from: Literal["last", "first"] = "last"
    """The impact that time begins at. From the first one the verdict is in time whatever follows, but rests on less:
    judge the tilt, too. Paper: the last."""
    missed_s: Positive | None = None
    """Time after the planned one at which an impact that did not come is missed; None takes zeta_s [s]."""

    @classmethod
    def table1(cls, name: Table1, **changes: Any) -> Self:
        """Return a published set for simulated impacts: always expected are 0 ("strict"), +-2 ("medium"), +-4 deg.

        Tab. 1 verbatim; the refractory time, which the paper does not have, is 0. `changes` are put on top: r_b is not
        published.
        """
        return cls._published(_TABLE_1, name, changes)

    @classmethod
    def table2(cls, name: Table2, **changes: Any) -> Self:
        """Return a published set for the experiment (Tab. 2): always expected are 0 ("strict") or 0-8 deg ("wide")."""
        return cls._published(_TABLE_2, name, changes)

    @classmethod
    def raw_error(cls, **changes: Any) -> Self:
        """Return the baseline without an envelope: the velocity error itself, after 30 samples, with a large margin."""
        return cls(**{"envelope": False, "m_c": 30, "e_m_rad_s": 0.4} | changes)

    @classmethod
    def _published(cls, table: dict[str, dict[str, float]], name: str, changes: dict[str, Any]) -> Self:
        if name not in table:
            raise ConfigError("aimaware", "", f"no published set {name!r}; there are {', '.join(table)}", name)
        return cls(**{"impact": ImpactConfig(refractory_s=0.0), **table[name], **changes})

    @property
    def latest_s(self) -> float:
        """How long after the planned time an impact is missed [s]."""
        return self.zeta_s if self.missed_s is None else self.missed_s

    def margins(self, n: int) -> NDArray[np.float64]:
        """Return e_m for each of n joints (n,) [rad/s].

        Raises:
            ConfigError: if there are neither one nor n numbers.
        """
        return per_joint("aimaware", "e_m_rad_s", self.e_m_rad_s, n)

    def fitted_to(self, rate_hz: float, *, from_hz: float = 1000.0) -> Self:
        """Return these settings with windows of the same time at another sampling rate; within 5 % they stay."""
        scale = rate_hz / from_hz
        if abs(scale - 1) <= 0.05:
            return self
        return self.model_copy(update={"m_max": round(self.m_max * scale), "m_c": round(self.m_c * scale)})
