"""Settings of the detection of contact."""

from __future__ import annotations

import itertools
from typing import Annotated, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from tactful.config import Config, ConfigError
from tactful.signals import bins_in_band

PositiveFloat = Annotated[float, Field(gt=0)]
NonNegativeFloat = Annotated[float, Field(ge=0)]


class FrequencyConfig(Config):
    """The frequency content of the external force as a sign of contact: condition (4) of the paper."""

    threshold_n: PositiveFloat | tuple[PositiveFloat, PositiveFloat, PositiveFloat] = 0.85
    """F_th, the level that means contact, for all directions or for x, y and z [N]."""
    band_hz: tuple[PositiveFloat, PositiveFloat] = (10.0, 100.0)
    """Frequency range of the level, ends included [Hz]."""
    window: Annotated[int, Field(ge=2)] = 500
    """N, the length of the sliding window [samples]."""
    norm: Literal["inf"] | Annotated[float, Field(ge=1)] = "inf"
    """p of the norm over the band, or "inf" for the largest amplitude, as in the paper."""

    def check_rate(self, rate_hz: float) -> None:
        """Check that the rate carries the band.

        Raises:
            BandError: if it does not; the error names the largest band that it carries.
        """
        bins_in_band(self.band_hz, rate_hz, self.window)


class NoiseConfig(Config):
    """What the sensors and the model are uncertain of, one number for all joints or one each.

    None takes a share of the joint's torque limit (behind the gear: of 100 Nm at most; for a wrench: of 25 N and 5 Nm),
    as an arm has it that nobody calibrated; `tactful calibrate` measures it.
    """

    velocity_rad_s: NonNegativeFloat | tuple[NonNegativeFloat, ...] = 0.008
    """Standard deviation of the white noise of dq [rad/s]. A real Panda has 0.0055-0.0075."""
    torque_nm: NonNegativeFloat | tuple[NonNegativeFloat, ...] | None = None
    """Standard deviation of the white noise of the measured torque, or of tau_ext [Nm]; None: 0.4 % of the limit."""
    model_nm: NonNegativeFloat | tuple[NonNegativeFloat, ...] | None = None
    """Standard deviation of the slow error of the external torque that is left after its drift [Nm]; None: 1.2 %."""
    model_nms: NonNegativeFloat | tuple[NonNegativeFloat, ...] = 0.0
    """What the speed of the joint adds to that, in squares [Nm per rad/s]."""
    reversal_nm: NonNegativeFloat | tuple[NonNegativeFloat, ...] = 0.0
    """What a joint that has just reversed adds to it, in squares: its friction changes, and no model of it is exact [Nm
    for each unit by which the friction, from -1 to 1, differs from its slow mean]."""
    correlation: tuple[tuple[Annotated[float, Field(ge=-1, le=1)], ...], ...] = ()
    """Correlation of the error of the model between the joints, a row each; none: they are independent."""

    def correlations(self, n: int) -> NDArray[np.float64]:
        """Return the correlation of the error between n joints (n, n).

        Raises:
            ConfigError: if it is not that of n joints: symmetric, 1 with itself, positive definite.
        """
        if not self.correlation:
            return np.eye(n)
        if [len(row) for row in self.correlation] != [n] * n:
            raise ConfigError("noise", "correlation", f"has {len(self.correlation)} rows; give {n} of {n} numbers")
        R = np.array(self.correlation)
        if not (np.allclose(R, R.T) and np.allclose(np.diag(R), 1) and np.linalg.eigvalsh(R)[0] > 0):
            raise ConfigError(
                "noise", "correlation", "is none: it is symmetric, positive definite and 1 on its diagonal"
            )
        return R

    def resolved(self, key: str, scale_nm: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return one number for each joint; `scale_nm` (n,) is what a share is of.

        Raises:
            ConfigError: if there are neither one nor n numbers.
        """
        value = getattr(self, key)
        if value is None:
            return {"torque_nm": 0.004, "model_nm": 0.012}[key] * scale_nm
        numbers = np.atleast_1d(np.asarray(value, dtype=np.float64))
        if len(numbers) not in (1, len(scale_nm)):
            raise ConfigError("noise", key, f"has {len(numbers)} numbers; give one, or one for each of {len(scale_nm)}")
        return np.array(np.broadcast_to(numbers, scale_nm.shape))


class FastConfig(Config):
    """The generalized likelihood ratio detector, see `detection._glr.step`."""

    windows_s: Annotated[tuple[PositiveFloat, ...], Field(min_length=1, max_length=8)] = (
        0.005,
        0.01,
        0.02,
        0.04,
        0.08,
        0.16,
    )
    """Lengths of the windows, ascending [s]: short ones find impacts, long ones pushes. A length below a sample is one
    sample."""
    threshold: PositiveFloat | tuple[PositiveFloat, ...] = (9.0, 9.0, 9.0, 6.0, 6.0, 6.0)
    """Statistic that means contact, for all windows or one each, in standard deviations of a chi distribution with n
    degrees of freedom. The default is for an arm that nobody calibrated, and comes down to a quarter at least where its
    motion shows less; `tactful calibrate` sets it for a stated rate of false alarms."""
    drift_s: PositiveFloat = 0.5
    """Time constant with which a slow change of the external torque is forgotten [s]."""
    contact_drift_s: PositiveFloat = 0.15
    """The same while there is a contact: what stays is forgotten, so that another contact shows [s]."""
    envelope_s: PositiveFloat = 0.1
    """Time constant of the mean of the level that a rise is held against [s]."""
    rise: PositiveFloat = 1.5
    """How many times its mean the level rises to in a collision when something further touches the arm."""
    abrupt_rise: PositiveFloat = 4.0
    """The same in a cooperation, of the windows up to 20 ms: what comes into a hand is an obstacle, and abrupt."""
    bias_s: PositiveFloat = 30.0
    """Time constant with which the bias of the external torque is followed while nothing suggests a contact, that is
    while the level is below half of the threshold: sensors that warm up, a tool that was changed [s]."""
    bias_limit: NonNegativeFloat = 2.0
    """Bound on that bias, in standard deviations `model_nm`; 0 follows none."""
    slow_hz: PositiveFloat = 8.0
    """Cut-off of the slow external torque that says whether a contact is over [Hz]."""
    release: PositiveFloat | tuple[PositiveFloat, ...] = 5.0
    """A contact lasts while the slow external torque of a joint differs by more than this from that before it, in
    standard deviations `model_nm`; one number for all joints or one each."""
    decide_s: NonNegativeFloat = 0.02
    """Time after the detection at which the contact is classified, from what was seen by then [s]."""
    decide_until_s: NonNegativeFloat = 0.2
    """How long a contact whose kind is not clear then is looked at again, each `decide_s` [s]."""

    @model_validator(mode="after")
    def _windows_and_thresholds_fit(self) -> FastConfig:
        if any(b <= a for a, b in itertools.pairwise(self.windows_s)):
            raise ValueError("windows_s have to ascend")
        if isinstance(self.threshold, tuple) and len(self.threshold) != len(self.windows_s):
            raise ValueError(f"{len(self.threshold)} thresholds for {len(self.windows_s)} windows_s")
        return self

    def windows(self, rate_hz: float) -> dict[int, float]:
        """Return the lengths of the windows at a rate [samples], ascending, each with its threshold.

        Windows that are the same at a low rate become one, with the highest of their thresholds.
        """
        thresholds = self.threshold if isinstance(self.threshold, tuple) else (self.threshold,) * len(self.windows_s)
        windows: dict[int, float] = {}
        for window_s, threshold in zip(self.windows_s, thresholds, strict=True):
            length = max(1, round(window_s * rate_hz))
            windows[length] = max(threshold, windows.get(length, 0.0))
        return windows


class ContactConfig(Config):
    """When one contact begins, goes on and ends. The paper's own value is named where it differs from the default."""

    release_ratio: Annotated[float, Field(gt=0, le=1)] = 0.7
    """A direction is quiet when its level is below this share of the threshold. Paper: 1."""
    hold_s: NonNegativeFloat = 0.1
    """How long a direction has to be quiet before it counts as released [s]. Paper: 0."""
    release_force_n: PositiveFloat | None = 1.5
    """A contact lasts while the force differs by more than this from the force before it, in any direction [N]: the
    level has no constant part, so it falls to zero half a second into a steady push. None looks at the level alone.
    Paper: None."""
    collision_to_free: bool = True
    """Whether a collision ends when all is quiet. Paper: false, the transition is not part of Algorithm 1."""
    merge_s: NonNegativeFloat = 0.15
    """A further direction whose rise began at most so long after that of the contact that is there belongs to it: one
    impact spreads over the axes and would be classified again [s]. Paper: 0."""
    search_s: PositiveFloat = 0.5
    """How far back the search for the contact time goes [s]. The paper does not say."""
    onset_fraction: Annotated[float, Field(gt=0, lt=1)] = 0.15
    """Share of the rise at which the contact time is set, see `onset_index`. The paper does not say."""
    warm_up_s: NonNegativeFloat = 0.0
    """Time after a start in which nothing is detected, beyond the window that has to fill [s]."""
    gap_s: PositiveFloat = 0.05
    """A step in time longer than this, and than five samples, makes the monitor start anew [s]."""
