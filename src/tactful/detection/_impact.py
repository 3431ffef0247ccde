"""The impact detector: conditions (8) and (9) of the aim-aware paper."""

from __future__ import annotations

import functools
import math
from typing import Annotated, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import Field

from tactful._njit import njit
from tactful.config import Config, per_joint
from tactful.errors import TactfulError

Array = NDArray[np.float64]
Bound = Annotated[float, Field(gt=0, allow_inf_nan=True)]

_SLACK_S = 1e-9
"""Rounding of times that is not taken for a difference [s]."""


class ImpactConfig(Config):
    """The detection of impacts, also from within a contact, see `ImpactDetector`."""

    r_b_nm_s: Bound | tuple[Bound, ...] = 4000.0
    """r_b, the rate of the residual that means an impact, for all joints or one each; inf leaves a joint out [Nm/s]. It
    has to lie between the noise of the rate and the weakest impact. The paper does not give it."""
    refractory_s: Annotated[float, Field(ge=0)] = 0.01
    """Time after an impact in which no other is told [s]. Paper: 0."""
    bandpass_hz: Annotated[float, Field(gt=0)] | None = None
    """Upper corner of a band-pass observer, the lower one being the observer's bandwidth; None takes the plain
    difference, (8) of the paper [Hz]."""


@functools.cache
def impact_dtype(n: int) -> np.dtype[np.void]:
    """Return the layout of the settings and the state of a detector for n joints."""
    return np.dtype(
        [
            ("r_b", "f8", (n,)),
            ("refractory", "f8"),
            ("corner", "f8"),  # of the band-pass [1/s]; inf: the plain difference
            ("seen", "i8"),  # samples, up to 2
            ("since", "f8"),  # time since the last impact [s]
            ("r", "f8", (n,)),  # of the sample before
            ("rate", "f8", (n,)),  # dr/dt [Nm/s]
        ],
        align=True,
    )


def impact_record(n: int, config: ImpactConfig) -> Any:
    """Return a detector that has seen nothing.

    Raises:
        ConfigError: if there are neither one nor n bounds.
    """
    record: Any = np.zeros(1, impact_dtype(n))
    record["r_b"] = per_joint("impact", "r_b_nm_s", config.r_b_nm_s, n)
    record["refractory"] = config.refractory_s
    record["corner"] = math.inf if config.bandpass_hz is None else 2 * math.pi * config.bandpass_hz
    record["since"] = math.inf
    return record


@njit(cache=True)
def detect(detector: Any, dt: float, r: Array) -> bool:
    """Take the residual r (n,) [Nm] of one sample, the time dt [s] after the one before; return whether it impacts."""
    impact = False
    share = 1.0 if detector.corner == np.inf else 1.0 / (1.0 + detector.corner * dt)
    for i in range(r.shape[0]):
        if detector.seen > 0:
            rate, before = (r[i] - detector.r[i]) / dt, detector.rate[i]
            if detector.corner < np.inf:  # corner s / (s + corner), implicitly
                rate = share * before + (1.0 - share) * rate
            if detector.seen > 1 and abs(rate) >= detector.r_b[i] and abs(before) < detector.r_b[i]:
                impact = True
            detector.rate[i] = rate
        detector.r[i] = r[i]
    if detector.seen > 0:
        detector.since += dt
    detector.seen = min(detector.seen + 1, 2)
    if impact and detector.since < detector.refractory - _SLACK_S:
        return False
    if impact:
        detector.since = 0.0
    return impact


@njit(cache=True)
def _run(detector: Any, dt: Array, r: Array, impact: NDArray[np.bool_], rate: Array) -> None:
    for k in range(dt.shape[0]):
        impact[k] = detect(detector, dt[k], r[k])
        for i in range(r.shape[1]):
            rate[k, i] = detector.rate[i]


class ImpactDetector:
    r"""Tell from the rate of a residual that something was struck, whether there already is contact or not.

    With dr_k = (r_k - r_(k-1)) / (t_k - t_(k-1)), sample k is an impact if for a joint i

        |dr_k,i| >= r_b,i    and    |dr_(k-1),i| < r_b,i.

    The difference of an observer's residual, a low-pass of tau_ext with the corner K_O, is a high-pass: both together
    are a band-pass from K_O to half the sampling rate. `bandpass_hz` sets the upper corner w instead,

        dr_k = (dr_(k-1) + w (r_k - r_(k-1))) / (1 + w h),

    which keeps the unit and the meaning of r_b for what is slower than w.

    Source: B. Proper et al. 2023, https://hal.science/hal-03974694v3, (8), (9); its abstract names the band-pass, its
    text does not give one. Different from it: a refractory time, by default 10 ms.

    Args:
        n: number of joints.
        config: the settings.

    Raises:
        ConfigError: if there are neither one nor n bounds.
    """

    def __init__(self, n: int, config: ImpactConfig | None = None) -> None:
        self._detector: Any = impact_record(n, config or ImpactConfig())
        self._t = -math.inf

    @property
    def rate(self) -> Array:
        """The rate dr (n,) of the last sample [Nm/s]."""
        return self._detector["rate"][0].copy()  # type: ignore[no-any-return]

    def update(self, t: float, r: ArrayLike) -> bool:
        """Take the residual r (n,) [Nm] at the time t [s] and return whether this sample is an impact."""
        return bool(self.run([t], np.asarray(r, dtype=np.float64)[None])[0])

    def run(self, t: ArrayLike, r: ArrayLike) -> NDArray[np.bool_]:
        """Take residuals r (k, n) [Nm] at the times t (k,) [s] and return which samples are impacts (k,).

        Raises:
            TactfulError: if the shapes do not fit or the time does not increase.
        """
        return self.trace(t, r)[0]

    def trace(self, t: ArrayLike, r: ArrayLike) -> tuple[NDArray[np.bool_], Array]:
        """Take residuals as `run` does, and return which samples are impacts (k,), and the rates dr (k, n) [Nm/s]."""
        time, residual = np.asarray(t, dtype=np.float64), np.require(r, np.float64, ["C", "W"])
        shape = (time.size, self._detector["r"].shape[1])
        if time.ndim != 1 or residual.shape != shape:
            raise TactfulError(f"r has shape {residual.shape}, but {shape[0]} samples of {shape[1]} joints are {shape}")
        dt = np.diff(time, prepend=self._t)  # (k,)
        if not np.all(dt > 0):
            k = int(np.argmin(dt > 0))
            raise TactfulError(f"t does not increase at sample {k}, {time[k]} s: leave it out, or reset the detector")
        impact, rate = np.empty(len(time), dtype=np.bool_), np.empty(shape)
        _run(self._detector[0], dt, residual, impact, rate)
        self._t = float(time[-1]) if len(time) else self._t
        return impact, rate

    def reset(self) -> None:
        """Begin anew with the next sample, whatever its time."""
        self._detector["seen"] = 0
        self._detector["since"] = math.inf
        self._detector["rate"] = 0.0
        self._t = -math.inf
