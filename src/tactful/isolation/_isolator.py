"""Where on an arm a contact is, by the evidence of its torque at each point of the surface."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import chdtrc, ndtri

from tactful.config import ConfigError, per_joint
from tactful.dynamics import Dynamics, arm_record, kernels, motion_record
from tactful.isolation._config import IsolationConfig
from tactful.isolation._grid import Grid
from tactful.isolation._locate import locate
from tactful.isolation._location import (
    NOT_POSITIVE,
    Array,
    ContactLocation,
    IsolationError,
    KnownContact,
    region_probabilities,
)
from tactful.isolation._wrench import WrenchPrior
from tactful.robots import Robot


class Isolator:
    r"""Tell on which link a contact is, at which point and with which force, from the external joint torque alone.

    Every point x of a grid on the links' surface is a hypothesis: a force f ~ N(m u, S) along the inward normal u makes
    the torque J_x^T f, so that

        tau_ext ~ N(m J_x^T u, J_x^T S J_x + Sigma),    S = diag(m/2, mu m/2, mu m/2)^2 in the axes of the normal,

    for a few magnitudes m. The probability of a link is the evidence averaged over its surface, with all links equally
    probable beforehand. Sigma holds all that is unknown: the noise and bias of tau_ext, the width of the grid, contacts
    that are already known. Its determinant is what keeps the distal links, which can explain any torque of the
    proximal ones, from being blamed for it. No threshold is tuned.

    What can be told is a matter of counting: three components of the force and two of the point against k torques for
    link k. So a point is named only where the posterior is narrow; else the candidates are.

    Args:
        robot: the arm; it needs capsules.
        config: the settings.

    Raises:
        RobotError: if the surface of no moving link is known.
        ConfigError: if a setting does not fit the robot.

    Example:
        >>> from tactful import Robot
        >>> from tactful.dynamics import Dynamics
        >>> from tactful.isolation import Isolator
        >>> panda = Robot.load("panda")
        >>> push = Dynamics(panda).jacobian(panda.home)[:3].T @ [0.0, 0.0, 15.0]
        >>> Isolator(panda).locate(panda.home, push).link
        'panda_link7'
    """

    def __init__(self, robot: Robot, config: IsolationConfig | None = None) -> None:
        self.robot = robot
        self.config = config = config or IsolationConfig()
        noise = per_joint("isolation", "noise_nm", config.noise_nm, robot.n)
        if config.fine_spacing_m > config.spacing_m:
            problem = f"is wider than spacing_m, {config.spacing_m} m"
            raise ConfigError("isolation", "fine_spacing_m", problem, config.fine_spacing_m)
        self._noise = np.diag(noise**2)  # (n, n)
        self._grid = Grid.of(robot, config)
        self._dynamics = Dynamics(robot)
        arm: Any = arm_record(robot)
        motion: Any = motion_record(robot.n)
        self._arm, self._motion = arm[0], motion[0]
        grid = self._grid
        self._records = (grid.cells, grid.fine, grid.capsules, grid.links, grid.atoms, grid.work)
        self._freedom = max(robot.n - 3, 1)  # three components of the force are fitted
        self._z = float(ndtri(0.5 + 0.5 * config.coverage))

    def locate(
        self,
        q: ArrayLike,
        tau_ext: ArrayLike,
        covariance: ArrayLike | None = None,
        known: Iterable[KnownContact] = (),
    ) -> ContactLocation:
        """Locate the contact that makes an external joint torque.

        Args:
            q: joint positions (n,) [rad].
            tau_ext: external joint torque (n,), from the environment on the robot [Nm].
            covariance: (n, n) of all errors of tau_ext, noise as well as bias [Nm^2]; by default that of
                `IsolationConfig.noise_nm`.
            known: contacts that are there already; what they explain is taken out, and what is not known of them goes
                into the covariance.

        Raises:
            IsolationError: if an argument has a wrong shape, is not finite, or the covariance is not positive definite.
        """
        return self._location(*self._update(*self._given(q, tau_ext, covariance, known)))

    def pair_log_odds(
        self,
        q: ArrayLike,
        tau_ext: ArrayLike,
        covariance: ArrayLike | None = None,
        known: Iterable[KnownContact] = (),
    ) -> float:
        r"""Return the log odds that another, unknown contact is at the tip beside the one that `locate` finds.

            log p(tau_ext | Sigma + J^T W J) - log p(tau_ext | Sigma),

        both over the whole surface, with the tip's Jacobian J and the prior W of its wrench: as strong as the forces on
        the surface, in any direction, and the moment of `WrenchPrior`. From
        `IsolationConfig.pair_log_odds` on, a single contact is not to be believed. It is stronger than the misfit
        (`ContactLocation.several`), as the friction cone and the determinant speak, too, and takes two updates.

        Args:
            q: see `locate`, as for the others.
            tau_ext: (n,) [Nm].
            covariance: (n, n) [Nm^2].
            known: contacts that are there already.

        Raises:
            IsolationError: see `locate`.
        """
        position, torque, Sigma = self._given(q, tau_ext, covariance, known)
        config = self.config
        square = np.mean(np.square(config.magnitudes_n)) * (1.25 + 0.5 * config.friction**2)  # of the force's magnitude
        W = np.repeat([square / 3, WrenchPrior().moment_nm ** 2], 3)  # (6,)
        J = self._dynamics.jacobian(position)  # (6, n)
        self._update(position, torque, Sigma)
        alone = float(self._grid.work["log_evidence"])
        self._update(position, torque, Sigma + J.T @ (W[:, None] * J))
        return float(self._grid.work["log_evidence"]) - alone

    def _given(
        self, q: ArrayLike, tau_ext: ArrayLike, covariance: ArrayLike | None, known: Iterable[KnownContact]
    ) -> tuple[Array, Array, Array]:
        """Return what is to be explained: joint positions, torque and covariance."""
        n = self.robot.n
        position, torque = self._checked("q", q, (n,)), self._checked("tau_ext", tau_ext, (n,))
        Sigma = self._noise.copy() if covariance is None else self._checked("covariance", covariance, (n, n))
        for contact in known:
            torque, Sigma = self._without(contact, position, torque, Sigma)
        return position, torque, Sigma

    def _update(self, q: Array, tau: Array, Sigma: Array) -> tuple[int, int]:
        kernels.place(self._arm, self._motion, q)
        best, atoms = locate(self._arm, self._motion, tau, Sigma, *self._records)
        if best < 0:
            raise IsolationError("covariance", NOT_POSITIVE)
        return best, atoms

    def _checked(self, name: str, value: ArrayLike, shape: tuple[int, ...]) -> Array:
        array = np.require(value, np.float64, ["C", "W"])
        if array.shape != shape:
            raise IsolationError(name, f"has shape {array.shape}; {self.robot.name} needs {shape}")
        if not np.isfinite(array).all():
            raise IsolationError(name, "has numbers that are not finite: skip this sample")
        return array

    def _without(self, contact: KnownContact, q: Array, tau: Array, Sigma: Array) -> tuple[Array, Array]:
        wrench = self._checked("wrench of the known contact", contact.wrench, (6,))
        P = self._checked("covariance of the known contact", contact.covariance, (6, 6)).copy()
        P[:3, :3] += contact.drift_n**2 * np.eye(3)
        J = self._dynamics.jacobian_at(q, contact.link, contact.point_m)  # (6, n)
        return tau - J.T @ wrench, Sigma + J.T @ P @ J

    def _location(self, best: int, atoms: int) -> ContactLocation:
        config, work, found = self.config, self._grid.work, self._grid.atoms[:atoms]
        probabilities = self._grid.links["p"].copy()
        regions = region_probabilities(probabilities)
        region = max(regions, key=regions.__getitem__)
        confidence = float(probabilities[best])
        mine = np.flatnonzero(found["link"] == best)
        p = found["p"][mine] / confidence
        order = np.argsort(found["area"][mine] / np.maximum(p, 1e-300))  # densest first
        order = order[: int(np.searchsorted(np.cumsum(p[order]), config.coverage)) + 1]
        cov = work["point_cov"].copy()
        narrow = cov.trace() <= config.point_spread_m**2
        size, variance = work["size"].tolist()
        reach = self._z * variance**0.5
        misfit = max(float(work["misfit"]), 0.0)
        explained = float(chdtrc(self._freedom, misfit))
        return ContactLocation(
            link=self.robot.link_names[best],
            link_index=best,
            confidence=confidence,
            link_probabilities=probabilities,
            region=region,
            region_confidence=regions[region],
            ambiguous=confidence < config.sure,
            point_m=work["point"].copy() if narrow else None,
            point_covariance=cov if narrow else None,
            candidates_m=found["x"][mine[order]],
            candidates_p=p[order],
            force_n=work["force"].copy(),
            force_covariance=work["force_cov"].copy(),
            magnitude_n=size,
            magnitude_interval_n=(max(size - reach, 0.0), size + reach),
            signal=float(work["square"]),
            misfit=misfit,
            explained=explained,
            several=explained < config.false_misfit,
        )
