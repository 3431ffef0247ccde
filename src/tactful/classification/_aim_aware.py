"""Expected or unexpected impact, from what was planned."""

from __future__ import annotations

import copy
from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tactful.classification import _aim_aware_kernel as kernel
from tactful.classification._aim_aware_config import AimAwareConfig
from tactful.classification._aim_aware_result import VERDICTS, AimAwareResult, ImpactVerdict, result_of
from tactful.errors import TactfulError
from tactful.impacts import ImpactPlan

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False, slots=True)
class AimAwareTrace:
    """What the classifier saw in every sample, for a picture.

    Attributes:
        t: times (k,) [s].
        verdict: code of the verdict (k,), an index into `VERDICTS`.
        e_vel: error of the joint velocity against the post-impact reference (k, n) [rad/s].
        lower, upper: its envelope (k, n) [rad/s]; it means something from the first impact on.
    """

    t: Array
    verdict: NDArray[np.int8]
    e_vel: Array
    lower: Array
    upper: Array


class AimAware:
    r"""Tell whether an intended impact went as planned, from joint positions, velocities and a residual.

    An impact is a jump of the residual's rate (`ImpactDetector`). At each impact j,

        |t_j - t_d| <= zeta,    ||q(t_j) - q_d(t_d)|| <= epsilon,    t_j - t_(j-1) <= iota;

    afterwards the velocity error against the rigid post-impact reference, e = dq - dq_d(t), oscillates about zero. With
    its envelope (`CausalEnvelope`), which begins anew at each impact,

        e_lb - e_m <= 0 <= e_ub + e_m    from m_c samples after the last impact to xi after it;

    if all that holds, the impact is expected, else unexpected. The verdict comes xi after the last impact; with
    `xi_from = "first"` xi after the first one, from what was seen until then.

    "literal" is Algorithm 1 as it is printed. "corrected", the default, differs from it:

    - the window of the envelope is m = 0 at an impact (printed: 1, which reaches to the sample before it);
    - before the first impact there is no verdict, and before the plan's window the classifier is off (printed:
      unexpected, as t_j is not defined);
    - the first verdict stays (printed: a later impact may turn it);
    - the conditions at the time of impact hold for all impacts, as (10) to (12) say (printed: for the last one);
    - an impact that does not come until `missed_s` after t_d is "missed" (printed: no verdict, for ever); if it comes
      later all the same, it is unexpected;
    - only impacts within the plan's window count.

    Samples that are not finite or do not advance in time are counted and skipped.

    Source: B. Proper, A. Kurdas, S. Abdolshah, S. Haddadin, A. Saccon, "Aim-aware collision monitoring", IEEE RA-L
    2023, https://hal.science/hal-03974694v3.

    Args:
        plan: what is to happen.
        config: the settings.

    Raises:
        ConfigError: if a setting has another number of joints than the plan.

    Example:
        >>> from tactful.classification import AimAware
        >>> from tactful.impacts import ImpactPlan
        >>> aim = AimAware(ImpactPlan(0.5, [0.1, 0.2], [0.5], [[0.0, 0.0]]))
        >>> aim.update(0.4, q=[0.1, 0.2], dq=[0.0, 0.1], r=[0.0, 0.0])
        'yet unknown'
    """

    def __init__(self, plan: ImpactPlan, config: AimAwareConfig | None = None) -> None:
        self.plan, self.config = plan, config or AimAwareConfig()
        self._record: Any = kernel.aim_aware_record(plan, self.config)
        self._reference = (np.array(plan.post_t_s), np.array(plan.post_dq))

    @property
    def verdict(self) -> ImpactVerdict:
        """What the impact is, as far as it is known."""
        return VERDICTS[int(self._record["verdict"][0])]

    @property
    def result(self) -> AimAwareResult:
        """The verdict with its evidence."""
        return result_of(self._record[0], self.config)

    def update(self, t: float, q: ArrayLike, dq: ArrayLike, r: ArrayLike) -> ImpactVerdict:
        """Take one sample at the time t [s] and return the verdict; see `run`."""
        rows = (np.asarray(x, dtype=np.float64)[None] for x in (t, q, dq, r))
        return VERDICTS[int(self.run(*rows)[0])]

    def run(self, t: ArrayLike, q: ArrayLike, dq: ArrayLike, r: ArrayLike) -> NDArray[np.int8]:
        """Take samples at the times t (k,) [s] and return the verdicts (k,), as indices into `VERDICTS`.

        Args:
            t: times (k,) [s].
            q: joint positions (k, n) [rad].
            dq: joint velocities (k, n) [rad/s].
            r: residual of a momentum observer (k, n) [Nm].

        Raises:
            TactfulError: if the shapes do not fit.
        """
        samples = self._samples(t, q, dq, r)
        verdict = np.empty(len(samples[0]), dtype=np.int8)
        empty = np.empty((0, self.plan.n))
        kernel.run(self._record[0], *self._reference, *samples, verdict, empty, empty, empty)
        return verdict

    def trace(self, t: ArrayLike, q: ArrayLike, dq: ArrayLike, r: ArrayLike) -> AimAwareTrace:
        """Take samples as `run` does, and return what the classifier saw in each."""
        samples = self._samples(t, q, dq, r)
        shape = samples[1].shape
        trace = AimAwareTrace(
            samples[0], np.empty(shape[0], dtype=np.int8), np.empty(shape), np.empty(shape), np.empty(shape)
        )
        kernel.run(self._record[0], *self._reference, *samples, trace.verdict, trace.e_vel, trace.lower, trace.upper)
        return trace

    def reset(self) -> None:
        """Forget all samples; the plan stays."""
        kernel.clear(self._record[0])

    def __copy__(self) -> Self:
        """Return a classifier of its own that goes on from here."""
        return copy.deepcopy(self)

    def _samples(self, t: ArrayLike, *channels: ArrayLike) -> tuple[Array, ...]:
        time = np.require(t, np.float64, ["C", "W"])
        samples = tuple(np.require(x, np.float64, ["C", "W"]) for x in channels)
        shape = (time.size, self.plan.n)
        for name, x in zip(("q", "dq", "r"), samples, strict=True):
            if time.ndim != 1 or x.shape != shape:
                raise TactfulError(
                    f"{name} has shape {x.shape}, but {shape[0]} samples of {shape[1]} joints are {shape}"
                )
        return time, *samples
