"""What stands in the cell."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol


class Fixture(Protocol):
    """Something that stands still in the cell and that the arm can meet.

    Any object with a name and `attach` is one; contacts with the body that it adds are told under that name.
    """

    @property
    def name(self) -> str:
        """Its name, unique in the cell."""
        ...

    def attach(self, world: Any) -> None:
        """Add one body called `name`, with its geoms, to the world (a `mujoco.MjsBody`)."""
        ...


@dataclass(frozen=True, kw_only=True)
class Box:
    """A box with its sides along the axes of the base.

    Attributes:
        name: its name.
        centre_m: (3,) its centre [m].
        size_m: (3,) its length along x, y and z [m].
        rgba: its colour.
    """

    name: str = "box"
    centre_m: tuple[float, float, float]
    size_m: tuple[float, float, float]
    rgba: tuple[float, float, float, float] = (0.83, 0.47, 0.30, 1.0)

    def attach(self, world: Any) -> None:
        """Add the box to the world."""
        import mujoco

        body = world.add_body(name=self.name, pos=self.centre_m)
        half = [length / 2 for length in self.size_m]
        body.add_geom(type=mujoco.mjtGeom.mjGEOM_BOX, size=half, rgba=self.rgba)


@dataclass(frozen=True, kw_only=True)
class Table:
    """A plane, endless and level.

    Attributes:
        name: its name.
        height_m: its height [m].
    """

    name: str = "table"
    height_m: float = 0.0

    def attach(self, world: Any) -> None:
        """Add the table to the world."""
        import mujoco

        body = world.add_body(name=self.name, pos=[0, 0, self.height_m])
        body.add_geom(type=mujoco.mjtGeom.mjGEOM_PLANE, size=[2, 2, 0.1], rgba=[0.92, 0.92, 0.90, 1])
