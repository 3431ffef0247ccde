"""Contacts at random, to be injected."""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import NDArray

from tactful.evaluation._errors import EvaluationError
from tactful.evaluation._inject import InjectedContact
from tactful.recordings import Recording
from tactful.robots import Robot

Array = NDArray[np.float64]

KINDS: tuple[Literal["impact", "push"], ...] = ("impact", "push")
IMPACT_N = (15.0, 60.0)
"""Peak force of an impact [N]."""
IMPACT_S = (0.02, 0.06)
"""Duration of an impact [s]."""
PUSH_N = (10.0, 30.0)
"""Force of a push [N]."""
PUSH_RISE_S = (0.1, 0.3)
"""Time in which a push rises, and falls [s]."""
PUSH_HOLD_S = (0.2, 0.8)
"""Time for which a push stays at its force [s]."""


def random_contacts(
    recording: Recording,
    robot: Robot | None,
    rng: np.random.Generator,
    *,
    count: int = 4,
    first: int = 0,
    distance_s: float = 0.5,
    skip_s: float = 1.0,
) -> tuple[InjectedContact, ...]:
    """Draw contacts that fit into a recording: impacts and pushes, at the tip and on the middle link, as many of each.

    Impacts are half sines of 20-60 ms with 15-60 N, pushes rise in 100-300 ms to 10-30 N, stay for 200-800 ms and fall
    as they rose; all uniform. Directions are uniform on the sphere. The line of the force goes through the axis of the
    link's surface at a random height, as that of a normal force on its capsule does. Times are uniform over all
    that leave the distance. Without joint positions the tip alone is touched.

    Args:
        recording: free of contact.
        robot: the arm; None for a recording of a wrench alone.
        rng: the source of all randomness.
        count: how many contacts.
        first: how many were drawn before, so that kinds and places are balanced over several calls, too.
        distance_s: least time between two, and after the last [s].
        skip_s: time at the beginning without a contact, in which a monitor fills its window [s].

    Raises:
        EvaluationError: the recording has labels, or is too short.
    """
    if recording.labels:
        raise EvaluationError(
            f"it has contacts already, the first at {recording.labels[0].start_s:g} s: "
            "contacts are injected into recordings that have none",
            source=recording.source,
        )
    if count < 1:
        raise EvaluationError(f"count is {count}: inject at least one contact")
    plans = [(kind, link) for kind in KINDS for link in _links(recording, robot)]
    plans = [plans[(first + i) % len(plans)] for i in rng.permutation(count)]
    rises = rng.uniform(*PUSH_RISE_S, count)
    pushes = 2 * rises + rng.uniform(*PUSH_HOLD_S, count)
    impacts = rng.uniform(*IMPACT_S, count)
    durations = np.where([kind == "impact" for kind, _ in plans], impacts, pushes)  # (count,)
    starts = _starts(recording, rng, durations, distance_s, skip_s)
    contacts = []
    for (kind, link), rise, duration, start in zip(plans, rises, durations, starts, strict=True):
        direction = rng.normal(size=3)
        force = rng.uniform(*(IMPACT_N if kind == "impact" else PUSH_N)) * direction / np.linalg.norm(direction)
        contacts.append(
            InjectedContact(
                kind=kind,
                start_s=float(start),
                end_s=float(start + duration),
                force_n=(float(force[0]), float(force[1]), float(force[2])),
                link=link,
                point_m=(0.0, 0.0, 0.0) if link is None or robot is None else _point(robot, link, rng),
                rise_s=float(rise),
            )
        )
    return tuple(contacts)


def _links(recording: Recording, robot: Robot | None) -> tuple[int | None, ...]:
    """Where contacts are: the tip (None), and the middle link where it can be."""
    return (None,) if robot is None or recording.q is None else (None, robot.n // 2)


def _point(robot: Robot, link: int, rng: np.random.Generator) -> tuple[float, float, float]:
    """Return a point (3,) on the axis of a link's surface, its centre of mass where the surface is not known [m]."""
    capsules = [capsule for capsule in robot.capsules if capsule.link == link]
    if capsules:
        capsule = capsules[int(rng.integers(len(capsules)))]
        point = capsule.p0_m + rng.uniform() * (capsule.p1_m - capsule.p0_m)
    else:
        point = robot.com[link]
    return float(point[0]), float(point[1]), float(point[2])


def _starts(
    recording: Recording, rng: np.random.Generator, durations: Array, distance_s: float, skip_s: float
) -> Array:
    """Return when contacts of these durations (k,) begin: uniform over all times that leave the distance [s]."""
    first_s, last_s = float(np.nanmin(recording.t)), float(np.nanmax(recording.t))
    needed_s = skip_s + float((durations + distance_s).sum())
    spare_s = last_s - first_s - needed_s
    if not spare_s >= 0:
        raise EvaluationError(
            f"{len(durations)} contacts need {needed_s:.1f} s, but it lasts {last_s - first_s:.1f} s: inject fewer",
            source=recording.source,
        )
    waits = np.sort(rng.uniform(0, spare_s, len(durations)))  # (k,)
    before = np.concatenate([[0.0], np.cumsum(durations + distance_s)[:-1]])  # (k,)
    return first_s + skip_s + waits + before  # type: ignore[no-any-return]
