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
        movable: whether it can be put elsewhere, see `WorkCell.move`.
    """

    name: str = "box"
    centre_m: tuple[float, float, float]
    size_m: tuple[float, float, float]
    rgba: tuple[float, float, float, float] = (0.83, 0.47, 0.30, 1.0)
    movable: bool = False

    def attach(self, world: Any) -> None:
        """Add the box to the world."""
        import mujoco

        body = world.add_body(name=self.name, pos=self.centre_m, mocap=self.movable)
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


@dataclass(frozen=True, kw_only=True)
class Bar:
    """A round bar with round ends.

    Attributes:
        name: its name.
        start_m: (3,) one end of its axis [m].
        end_m: (3,) the other end [m].
        radius_m: its radius [m].
        rgba: its colour.
    """

    name: str = "bar"
    start_m: tuple[float, float, float]
    end_m: tuple[float, float, float]
    radius_m: float = 0.02
    rgba: tuple[float, float, float, float] = (0.83, 0.47, 0.30, 1.0)

    def attach(self, world: Any) -> None:
        """Add the bar to the world."""
        import mujoco

        body = world.add_body(name=self.name)
        size = [self.radius_m, 0.0, 0.0]
        body.add_geom(
            type=mujoco.mjtGeom.mjGEOM_CAPSULE, fromto=[*self.start_m, *self.end_m], size=size, rgba=self.rgba
        )


@dataclass(frozen=True, kw_only=True)
class HoledBox:
    """A box on the table with a square hole in the middle of its top, closed below.

    Attributes:
        name: its name.
        centre_m: (2,) where the axis of the hole stands on the table [m].
        size_m: (3,) its length along x, y and z [m].
        hole_m: width of the hole [m].
        depth_m: depth of the hole [m].
        rgba: its colour.
    """

    name: str = "box"
    centre_m: tuple[float, float]
    size_m: tuple[float, float, float] = (0.16, 0.16, 0.14)
    hole_m: float
    depth_m: float = 0.08
    rgba: tuple[float, float, float, float] = (0.55, 0.62, 0.68, 1.0)

    def attach(self, world: Any) -> None:
        """Add the box to the world: a bottom and four walls."""
        import mujoco

        length, width, height = self.size_m
        hole, floor = self.hole_m / 2, height - self.depth_m
        body = world.add_body(name=self.name, pos=[*self.centre_m, 0.0])
        wall_x, wall_y = (length / 2 - hole) / 2, (width / 2 - hole) / 2  # half their thickness
        middle, half = floor + self.depth_m / 2, self.depth_m / 2
        parts = [([0.0, 0.0, floor / 2], [length / 2, width / 2, floor / 2])]
        for side in (-1.0, 1.0):
            parts.append(([side * (hole + wall_x), 0.0, middle], [wall_x, width / 2, half]))
            parts.append(([0.0, side * (hole + wall_y), middle], [hole, wall_y, half]))
        for position, size in parts:
            body.add_geom(type=mujoco.mjtGeom.mjGEOM_BOX, pos=position, size=size, rgba=self.rgba)
