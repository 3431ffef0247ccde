"""What an episode is to be."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from typing import Annotated, Any, Literal, get_args

import numpy as np
from pydantic import Field

from tactful.config import Config
from tactful.control import ImpedanceConfig
from tactful.errors import TactfulError
from tactful.simulation._operators import OPERATORS

EpisodeKind = Literal["free", "collision", "cooperation", "collision_then_cooperation", "cooperation_then_collision"]
Trajectory = Literal["free", "ideal", "border", "top", "side", "obstacle"]
SensorPreset = Literal["exact", "clean", "panda"]

KINDS: tuple[EpisodeKind, ...] = get_args(EpisodeKind)
PLACES = ("peg", "panda_link7", "panda_link6", "panda_link5", "panda_link4", "panda_link3")
"""What a hand can touch."""
_TRAJECTORIES: dict[str, tuple[Trajectory, ...]] = {
    "free": ("free",),
    "cooperation": ("free",),
    "collision": ("ideal", "border", "top", "side", "obstacle", "top", "side", "obstacle"),
    "collision_then_cooperation": ("border", "top", "side", "obstacle", "top", "side", "obstacle"),
    "cooperation_then_collision": ("border", "top", "side", "obstacle"),
}
_SPEEDS_M_S = (0.08, 0.14, 0.22)


class EpisodeSpec(Config):
    """All that decides an episode: the same spec is the same recording, row by row."""

    kind: EpisodeKind
    """What happens: no contact at all, only collisions, only cooperation in free motion, or one after the other."""
    seed: Annotated[int, Field(ge=0)]
    """What everything is drawn from that stands not here."""
    trajectory: Trajectory = "free"
    """Where the reference leads: about freely, into the hole (`ideal`), onto its border, the top or the side of the
    box, or a link against a bar."""
    approach: Literal["diagonal", "axis"] = "diagonal"
    """Straight, or along one axis of the base after the other."""
    speed_m_s: Annotated[float, Field(gt=0, le=0.5)] = 0.14
    """Mean speed of the reference [m/s]."""
    operator: str | None = None
    """Who helps, one of `OPERATORS`."""
    place: str | None = None
    """What the hand touches, one of `PLACES`."""
    sensors: SensorPreset = "clean"
    """Preset of the sensors."""
    arm: Annotated[int, Field(ge=0)] = 0
    """Which arm: the errors of its model, its offsets and the phases of its ripple are drawn from this number alone."""
    mismatch: Annotated[float, Field(ge=0)] = 1.0
    """Scale of the errors of the arm's model, see `mistaken`; 0 is a perfect model."""
    payload_error_kg: float = 0.0
    """By how much the peg is heavier than the model says [kg]."""
    elastic: bool = False
    """Whether the joints are elastic."""
    clearance_m: Annotated[float, Field(gt=0)] = 0.001
    """Between the peg and the walls of the hole on each side [m]."""
    impedance: ImpedanceConfig = ImpedanceConfig()

    @property
    def name(self) -> str:
        """A name that tells it from all others: what it is, and a hash."""
        digest = hashlib.sha256(self.model_dump_json().encode()).hexdigest()[:10]
        return f"{self.kind}-{self.trajectory}-{digest}"


def draw_plan(
    n: int,
    seed: int,
    *,
    sensors: SensorPreset = "clean",
    operators: Sequence[str] = tuple(OPERATORS),
    kinds: Sequence[EpisodeKind] = KINDS,
    arm: int = 0,
    elastic: bool = False,
    mismatch: float = 1.0,
) -> list[EpisodeSpec]:
    """Return a balanced plan of n episodes: kinds, operators, trajectories, places, speeds and approaches take turns.

    Args:
        n: how many episodes.
        seed: what the order and the seeds of the episodes are drawn from; plans of other seeds share no episode.
        sensors: preset of the sensors.
        operators: who helps; leave some out to hold them out.
        kinds: what happens; a kind that is named twice is drawn twice as often.
        arm: which arm does it all, as in an experiment with one robot; another number is another one.
        elastic: whether the joints are elastic.
        mismatch: scale of the errors of the arm's model.

    Raises:
        TactfulError: n is below 1, or an operator or kind is not known.
    """
    if n < 1 or seed < 0:
        raise TactfulError(f"a plan needs n from 1 and seed from 0, not n = {n} and seed = {seed}")
    for names, known, what in ((operators, OPERATORS, "operator"), (kinds, KINDS, "kind")):
        if not names:
            raise TactfulError(f"a plan needs at least one {what} of {', '.join(known)}")
        for name in names:
            if name not in known:
                raise TactfulError(f"there is no {what} {name!r}: choose from {', '.join(known)}")
    rng = np.random.default_rng(seed)
    turns = {
        key: _Turns(values, rng)
        for key, values in {
            "speed": _SPEEDS_M_S,
            "approach": ("diagonal", "axis"),
            **{f"operator {kind}": operators for kind in KINDS},
            **{f"place {kind}": PLACES for kind in KINDS},
            **{f"trajectory {kind}": _TRAJECTORIES[kind] for kind in KINDS},
            "kind": kinds,
        }.items()
    }
    plan = []
    for _ in range(n):
        kind = turns["kind"].next()
        helped = "cooperation" in kind
        plan.append(
            EpisodeSpec(
                kind=kind,
                seed=int(rng.integers(2**48)),
                trajectory=turns[f"trajectory {kind}"].next(),
                approach=turns["approach"].next(),
                speed_m_s=turns["speed"].next(),
                operator=turns[f"operator {kind}"].next() if helped else None,
                place=turns[f"place {kind}"].next() if helped else None,
                sensors=sensors,
                arm=arm,
                elastic=elastic,
                mismatch=mismatch,
            )
        )
    return plan


class _Turns:
    """Values that take turns in random order: all of them before any comes again."""

    def __init__(self, values: Sequence[Any], rng: np.random.Generator) -> None:
        self._values, self._rng, self._left = list(values), rng, list[Any]()

    def next(self) -> Any:
        """Return the next value."""
        if not self._left:
            self._left = [self._values[i] for i in self._rng.permutation(len(self._values))]
        return self._left.pop()
