"""Where the contact of a monitor is: the isolation, asked at events and every 10 ms."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tactful.dynamics import Dynamics
from tactful.isolation import ContactLocation, Isolator, KnownContact
from tactful.monitor._config import MonitorConfig
from tactful.monitor._event import Location
from tactful.monitor._kernel import TAU
from tactful.monitor._memory import WHERE_HZ, Memory
from tactful.robots import Robot

Array = NDArray[np.float64]

EVERY_S = 0.01
"""Time between two looks [s]."""
SETTLED_S = 0.03
"""Time after the onset from which a link is claimed: before, the torque is still on its way [s]."""
BASELINE_S = 0.2
"""Time before a contact over which the bias of the torque is averaged [s]."""
_MARGIN = 2.0
"""c, see `Locator`."""
_STRONGER = 0.9
"""Share of the evidence of an earlier torque from which on a later one replaces it."""
_DRIFT = 0.2 / math.sqrt(3.0)
"""Standard deviation of what each component of the force of a known contact has changed by, relative to the force."""


class Locator:
    """Locate the contact that is there, from the slow external torque of the memory.

    The torque of a contact is what came on top of the mean before its onset: the bias, which is kept as it is while the
    contact lasts. Its covariance is that of the noise behind the two poles of `WHERE_HZ`, w = 2 pi WHERE_HZ, and of the
    error of the model,

        Sigma = c^2 [(w^3 h / 4) M diag(sigma_dq^2) M + (w h / 4) diag(sigma_tau^2) + diag(e) R diag(e)]

    with e and R of the detector's V (`detection._glr.step`) and c = 2, since the error of the model is not white, and
    goes with the pose for all joints at once.
    The first contact of two is known to the second.

    Args:
        robot: the arm.
        memory: the monitor's memory.
        config: the settings.
    """

    def __init__(self, robot: Robot, memory: Memory, config: MonitorConfig) -> None:
        self._robot, self._memory, self._config = robot, memory, config
        self._isolator: Isolator | None = None
        self._dynamics = Dynamics(robot)
        self._baseline = np.zeros(robot.n)
        self._known: tuple[KnownContact, ...] = ()
        self._found: ContactLocation | None = None
        memory.record["locate_every"] = max(1, round(EVERY_S * config.rate_hz))

    def __getstate__(self) -> dict[str, Any]:
        """Leave the grid out: it is made anew where it is needed."""
        return {**self.__dict__, "_isolator": None}

    @property
    def isolator(self) -> Isolator:
        """The grid, made when it is first needed."""
        if self._isolator is None:
            self._isolator = Isolator(self._robot, self._config.isolation)
        return self._isolator

    @property
    def found(self) -> ContactLocation | None:
        """Where the contact is, as far as it was told."""
        return self._found

    def warm_up(self) -> None:
        """Make the grid and compile its kernels or load them compiled."""
        n = self._robot.n
        self.isolator.locate(np.zeros(n), np.zeros(n))

    def begin(self, baseline: Array, *, second: bool = False) -> None:
        """Look for a contact anew, beyond the torque before it (n,) [Nm], or for one beside the one that is there."""
        if not second:
            self._baseline, self._known = baseline, ()
        elif self._found is not None:
            self._known = (*self._known, self._found.known(drift_n=_DRIFT * self._found.magnitude_n))
        self._found = None

    def look(self, age_s: float) -> Location | None:
        """Return where the contact is that began `age_s` ago, None where nothing new is known of that.

        What is ambiguous does not replace what was clear, nor a weaker torque what a stronger one told.
        """
        sample = self._memory.sample[0]
        q = sample["q"].copy()
        torque = self._memory.record[0]["where"][1] - self._baseline
        found = self.isolator.locate(q, torque, self._covariance(q, sample["dq"]), self._known)
        before = self._found
        if before is not None and _worse(found, before):
            return None
        if age_s >= SETTLED_S:
            self._found = found
        return Location(
            link=found.link,
            confidence=found.confidence,
            ambiguous=found.ambiguous,
            region=found.region,
            region_confidence=found.region_confidence,
            point_m=None if found.point_m is None else tuple(found.point_m.tolist()),
            force_n=tuple(found.force_n.tolist()),
            magnitude_n=found.magnitude_n,
            magnitude_interval_n=found.magnitude_interval_n,
            several=found.several,
        )

    def _covariance(self, q: Array, dq: Array) -> Array:
        glr = self._memory.record[0]["glr"]
        h, w = 1 / self._config.rate_hz, 2 * np.pi * WHERE_HZ
        reversal = glr["model_reversal"] * (glr["friction"] - glr["slow_friction"])
        error = np.sqrt(glr["model_std"] ** 2 + (glr["model_speed"] * dq) ** 2 + reversal**2)
        Sigma = np.outer(error, error) * glr["correlation"] + np.diag(0.25 * w * h * glr["torque_variance"])
        if self._memory.sample[0]["source"] == TAU:
            M = self._dynamics.mass_matrix(q)
            Sigma += 0.25 * w**3 * h * (M * glr["velocity_variance"]) @ M
        return np.asarray(_MARGIN**2 * Sigma)


def _worse(found: ContactLocation, before: ContactLocation) -> bool:
    unclear, was_unclear = (location.ambiguous or location.several for location in (found, before))
    return unclear > was_unclear or (unclear == was_unclear and found.signal < _STRONGER * before.signal)
