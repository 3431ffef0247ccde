"""The policy: which reaction to which contact, and its limits."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Annotated, Literal, get_args

from pydantic import Field

from tactful.classification import Kind
from tactful.config import Config
from tactful.control import ImpedanceConfig
from tactful.errors import TactfulError
from tactful.monitor import ContactEvent

ReactionName = Literal["continue", "stop", "retract", "comply", "teach"]
PositiveFloat = Annotated[float, Field(gt=0)]


class Rule(Config):
    """One line of a policy: all that it names has to hold."""

    kind: Kind | None = None
    """Kind of the contact; None is any. `contact` is one that is not classified, or not yet."""
    reason: str | None = None
    """Why an impact was unexpected, as its event says; None is any."""
    confidence: Annotated[float, Field(ge=0, le=1)] = 0.0
    """How sure the classifier has to be of the kind."""
    reaction: ReactionName
    """What to do."""

    def holds(self, event: ContactEvent) -> bool:
        """Whether the rule speaks of such an event."""
        return (
            self.kind in (None, event.kind)
            and self.reason in (None, event.reason)
            and event.confidence >= self.confidence
        )


class ReactionConfig(Config):
    """What an arm does about its contacts: the first rule that holds decides, without one the motion goes on.

    This reduces contact forces; it is not a certified safety function, and replaces none.
    """

    rules: tuple[Rule, ...] = ()
    retract_m: PositiveFloat = 0.06
    """How far `retract` draws back along the force [m]."""
    retract_s: PositiveFloat = 0.3
    """In what time [s]."""
    release_s: PositiveFloat = 0.5
    """How long after the end of a contact `comply` and `teach` still give way [s]."""
    resume_s: PositiveFloat | None = None
    """How long after the end of a contact `stop` and `retract` take up the motion again; None: when told to [s]."""
    return_s: PositiveFloat = 1.0
    """Time in which the arm goes back to where it left its motion [s]."""
    guiding: Literal["free", "translation"] = "free"
    """What `teach` lets a hand move: all of the pose, or the position alone. Then orientation and posture are held by
    the impedance of the motion, which stays as it is: nothing but the reference's position is let go."""
    torque_share: Annotated[float, Field(gt=0, le=1)] = 1.0
    """Largest torque, as a share of the arm's limit (`Robot.torque_limit`)."""
    torque_rate_nm_s: PositiveFloat = 1000.0
    """Largest rate of change of a joint's torque, also from one reaction to the next [Nm/s]."""
    impedance: ImpedanceConfig = ImpedanceConfig()
    """The impedance of the arm in motion; complying, it keeps the damping alone."""
    braking: ImpedanceConfig = ImpedanceConfig(
        stiffness_n_m=600.0, damping_ns_m=100.0, stiffness_nm_rad=30.0, damping_nms_rad=6.0
    )
    """The impedance at a stop and in retreat: what moves the arm may be soft, what stops it should not."""

    def choose(self, event: ContactEvent) -> ReactionName:
        """Return the reaction to an event."""
        return next((rule.reaction for rule in self.rules if rule.holds(event)), "continue")


def _policy(**reactions: ReactionName) -> ReactionConfig:
    return ReactionConfig(rules=tuple(Rule(kind=kind, reaction=name) for kind, name in reactions.items()))


NAMED: Mapping[str, ReactionConfig] = MappingProxyType(
    {
        "continue": ReactionConfig(),
        "stop": _policy(contact="stop", collision="stop", unexpected_impact="stop"),
        "retract": _policy(contact="stop", collision="retract", unexpected_impact="retract"),
        "comply": _policy(contact="comply", collision="comply", unexpected_impact="comply", cooperation="comply"),
        "teach": _policy(contact="comply", collision="stop", unexpected_impact="stop", cooperation="teach"),
    }
)
"""Policies by name. A contact that is not classified yet stops the arm, or makes it comply, at once."""
assert set(NAMED) == set(get_args(ReactionName))


def load_policy(name_or_path: str | Path) -> ReactionConfig:
    """Return a policy by its name, or from a TOML file.

    Raises:
        TactfulError: if it is neither.
        ConfigError: if the file cannot be read, or has an unknown key or a value that is not allowed.
    """
    if str(name_or_path) in NAMED:
        return NAMED[str(name_or_path)]
    if Path(name_or_path).suffix != ".toml":
        raise TactfulError(f"no reaction is called {str(name_or_path)!r}: use {', '.join(NAMED)}, or a TOML file")
    return ReactionConfig.from_toml(name_or_path)
