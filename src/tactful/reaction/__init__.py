"""What an arm does about a contact: stop, retract, comply, be taught, or go on. Not a certified safety function."""

from tactful.reaction._config import NAMED, ReactionConfig, ReactionName, Rule, load_policy
from tactful.reaction._merge import TeachingConfig, TeachingError, merge
from tactful.reaction._reactions import Comply, Reaction, Retract, Stop, TaughtPath, Teach
from tactful.reaction._reactor import Plan, Reactor

__all__ = [
    "NAMED",
    "Comply",
    "Plan",
    "Reaction",
    "ReactionConfig",
    "ReactionName",
    "Reactor",
    "Retract",
    "Rule",
    "Stop",
    "TaughtPath",
    "Teach",
    "TeachingConfig",
    "TeachingError",
    "load_policy",
    "merge",
]
