"""What a served arm goes through."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Scene:
    """What stands in the cell, and what happens."""

    obstacle: bool = False
    reach_m: float = 0.12
    """How far along y the obstacle stands from the tip [m]."""
    contact_time_s: float | None = None
    """Time constant of its surface: smaller is harder [s]."""
    hand_s: float | None = None
    """When a hand pushes for a third of a second, on the clock of the cell [s]."""
