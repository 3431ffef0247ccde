"""What reactions are worth: collisions in simulation with and without them, and what really pressed."""

from tactful.studies.reactions._study import reactions_study

__all__ = ["reactions_study"]
