"""Single trials: a contact is drawn, its torque made and disturbed, and what isolation says is written down."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from tactful.dynamics import Dynamics
from tactful.estimation import external_wrench
from tactful.isolation import ContactLocation, IsolationConfig, Isolator, KnownContact, identify_wrench, region_of
from tactful.robots import Robot
from tactful.studies.isolation._baselines import last_over_threshold, least_squares_link
from tactful.studies.isolation._draw import FORCE_N, FRICTION, Contact, Draw

Array = NDArray[np.float64]
Row = dict[str, float]

NOISE_NM = 0.1
NOISES_NM = (0.05, 0.1, 0.2, 0.5)
DRIFT = 0.2
"""Root mean square change of the first contact's force, over the force, before the second comes."""
DEPARTURES: dict[str, tuple[float, float, float]] = {
    "as modelled": (FRICTION, 0.0, NOISE_NM),
    "friction up to 0.8": (0.8, 0.0, NOISE_NM),
    "surface 1 cm off": (FRICTION, 0.01, NOISE_NM),
    "noise twice as large as stated": (FRICTION, 0.0, 2 * NOISE_NM),
}
"""What is not as the isolation takes it to be: friction, displacement of the surface [m], true noise [Nm]."""
AT_TIP = "at the tip and on another link"
ON_ANY = "on any two links"
_REGIONS = ("proximal", "middle", "distal")


class Laboratory:
    """An arm, what is to be tested on it, and the source of randomness."""

    def __init__(self, robot: Robot, rng: np.random.Generator) -> None:
        self.robot, self.rng = robot, rng
        self.draw, self.dynamics = Draw(robot, rng), Dynamics(robot)
        self.isolators = {noise: Isolator(robot, IsolationConfig(noise_nm=noise)) for noise in NOISES_NM}

    def noise(self, noise_nm: float) -> Array:
        """Return an error of tau_ext (n,) [Nm]."""
        return noise_nm * self.rng.normal(size=self.robot.n)

    def claims_pair(self, q: Array, tau: Array) -> bool:
        """Whether two contacts are claimed by their odds."""
        isolator = self.isolators[NOISE_NM]
        return isolator.pair_log_odds(q, tau) > isolator.config.pair_log_odds


def describe(found: ContactLocation, true: Contact) -> Row:
    """Return how an answer compares with the truth."""
    best = found.candidates_m[0] if found.point_m is None else found.point_m
    size = float(np.linalg.norm(true.force_n))
    low, high = found.magnitude_interval_n
    return {
        "true": true.link,
        "link": found.link_index,
        "confidence": found.confidence,
        "region_right": found.region == region_of(true.link),
        "region": _REGIONS.index(found.region),
        "point_error_m": float(np.linalg.norm(best - true.point_m)),
        "point_named": found.point_m is not None,
        "candidate_error_m": float(np.linalg.norm(found.candidates_m - true.point_m, axis=1).min()),
        "force_n": size,
        "force_error": float(np.linalg.norm(found.force_n - true.force_n)) / size,
        "magnitude_error": abs(found.magnitude_n - size) / size,
        "magnitude_inside": low <= size <= high,
        "misfit": found.several,
    }


def links(lab: Laboratory, _: str) -> list[Row]:
    """One contact, at every noise level, by every method."""
    q, true = lab.draw.posed_contact()
    unit, rows = lab.noise(1.0), []
    for noise in NOISES_NM:
        tau = true.torque_nm + noise * unit
        row = describe(lab.isolators[noise].locate(q, tau), true)
        row["noise_nm"] = noise
        row["threshold"] = last_over_threshold(tau, noise)
        row["least_squares"] = least_squares_link(lab.dynamics, q, tau, noise)
        row["odds"] = noise == NOISE_NM and lab.claims_pair(q, tau)
        rows.append(row)
    return rows


def departures(lab: Laboratory, name: str) -> list[Row]:
    """One contact where something is not as the isolation takes it to be."""
    friction, displaced_m, noise = DEPARTURES[name]
    q, true = lab.draw.posed_contact(friction=friction, displaced_m=displaced_m)
    return [describe(lab.isolators[NOISE_NM].locate(q, true.torque_nm + lab.noise(noise)), true)]


def known(lab: Laboratory, link: str) -> list[Row]:
    """A contact at the tip that has been identified, drifts, and is joined by a second one."""
    rng = lab.rng
    q, second = lab.draw.posed_contact(int(link))
    J = lab.dynamics.jacobian(q)  # (6, n)
    direction = rng.normal(size=3)
    first = rng.uniform(*FORCE_N) * direction / np.linalg.norm(direction)
    before = identify_wrench(J, J[:3].T @ first + lab.noise(NOISE_NM))
    drifted = first + DRIFT * np.linalg.norm(first) / np.sqrt(3) * rng.normal(size=3)
    tau = J[:3].T @ drifted + second.torque_nm + lab.noise(NOISE_NM)
    contact = KnownContact.at_frame(
        lab.robot,
        q,
        [*before.force_n, *before.moment_nm],
        before.covariance,
        drift_n=DRIFT * before.magnitude_n / np.sqrt(3),
    )
    isolator = lab.isolators[NOISE_NM]
    row = describe(isolator.locate(q, tau, known=[contact]), second)
    row["unaware"] = isolator.locate(q, tau).link_index
    return [row]


def pairs(lab: Laboratory, which: str) -> list[Row]:
    """Two contacts, neither known, and whether that is noticed: on any two links, or at the tip and on another."""
    rng, tip = lab.rng, lab.robot.frames[lab.robot.tip].link
    while True:
        one, two = sorted(int(link) for link in rng.choice(lab.draw.links, size=2, replace=False))
        if which == AT_TIP:
            one, two = int(rng.choice([link for link in lab.draw.links if link < tip])), tip
        q, first = lab.draw.posed_contact(one)
        if which == AT_TIP:
            direction = rng.normal(size=3)
            force = rng.uniform(*FORCE_N) * direction / np.linalg.norm(direction)
            torque = lab.dynamics.jacobian(q)[:3].T @ force
            break
        second = lab.draw.contact(q, two)
        if second is not None:
            torque = second.torque_nm
            break
    tau = first.torque_nm + torque + lab.noise(NOISE_NM)
    found = lab.isolators[NOISE_NM].locate(q, tau)
    row: Row = {"nearer": one, "farther": two, "link": found.link_index, "confidence": found.confidence}
    return [row | {"misfit": found.several, "odds": lab.claims_pair(q, tau)}]


def singular(lab: Laboratory, near: str) -> list[Row]:
    """A force at the tip in a pose that is drawn, or the most singular of many that are."""
    rng = lab.rng
    poses = [lab.draw.pose() for _ in range(int(near))]
    jacobians = [lab.dynamics.jacobian(q) for q in poses]
    J = min(jacobians, key=lambda jacobian: float(np.linalg.svd(jacobian, compute_uv=False)[-1]))  # (6, n)
    direction = rng.normal(size=3)
    force = rng.uniform(*FORCE_N) * direction / np.linalg.norm(direction)
    tau = J.T @ np.concatenate([force, 0.1 * rng.normal(size=3)]) + lab.noise(NOISE_NM)
    found = identify_wrench(J, tau)
    estimates = {
        "pseudo-inverse": (np.linalg.pinv(J.T) @ tau)[:3],
        "truncated": (np.linalg.pinv(J.T, rcond=0.05) @ tau)[:3],
        "damped": external_wrench(J, tau).force_n,
        "prior": found.force_n,
    }
    row: Row = {name: float(np.linalg.norm(estimate - force)) for name, estimate in estimates.items()}
    inside = (found.interval[:3, 0] <= force) & (force <= found.interval[:3, 1])
    return [row | {"sigma_min": found.sigma_min, "inside": int(inside.sum())}]


TRIALS: dict[str, Callable[[Laboratory, str], list[Row]]] = {
    "links": links,
    "departures": departures,
    "known": known,
    "pairs": pairs,
    "singular": singular,
}
