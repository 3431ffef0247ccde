"""Points on the surface of an arm's links, with inward normals, in cells of a coarse grid."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from tactful.robots import Capsule, Robot, RobotError

Array = NDArray[np.float64]
Indices = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Surface:
    """The surface of the moving links, sampled twice: fine points, and cells that hold them.

    A cell stands at one of its own fine points. What lies inside another capsule of the same link is no surface. All
    is in the frame of the link.

    Attributes:
        cell_link: (c,) the link of each cell, ascending.
        cell: (c, 6) position [m] and inward normal.
        cell_area: (c,) [m^2].
        cell_start: (c + 1,) where the fine points of each cell start.
        fine: (k, 6) position [m] and inward normal, in the order of the cells.
        fine_area: (k,) [m^2].
        spread_m: (2, n) how far the surface of a cell, and of a fine point, lies from it: standard deviation along one
            tangent, by link [m].
        turn: (2, n) how far the normal turns within: standard deviation of one tangential component, by link.
    """

    cell_link: Indices
    cell: Array
    cell_area: Array
    cell_start: Indices
    fine: Array
    fine_area: Array
    spread_m: Array
    turn: Array

    @classmethod
    def of(cls, robot: Robot, spacing_m: float, fine_spacing_m: float) -> Surface:
        """Sample the capsules of a robot.

        Args:
            robot: the arm.
            spacing_m: width of a cell [m].
            fine_spacing_m: distance between fine points [m].

        Raises:
            RobotError: if no moving link has a capsule.
        """
        by_link = [[c for c in robot.capsules if c.link == link] for link in range(robot.n)]
        if not any(by_link):
            raise RobotError(
                robot.name, "capsules", "are empty: a contact can only be located on links whose surface is known"
            )
        cells: list[tuple[int, Array, Array, Array]] = []  # link, points, normals and areas of its members
        for link, capsules in enumerate(by_link):
            for capsule in capsules:
                x, normal, area = _exposed(capsule, capsules, fine_spacing_m)
                home = _nearest(x, capsule_points(capsule, spacing_m)[0])  # (k,)
                cells += [(link, x[home == i], normal[home == i], area[home == i]) for i in np.unique(home)]
        centres = [int(np.argmin(np.linalg.norm(x - x.mean(axis=0), axis=1))) for _, x, _, _ in cells]
        links = np.array([link for link, *_ in cells])
        fine = np.concatenate([np.hstack([x, u]) for _, x, u, _ in cells])  # (k, 6)
        start = np.cumsum([0, *(len(x) for _, x, _, _ in cells)])
        centre = start[:-1] + centres  # (c,)
        spread, turn = np.zeros((2, robot.n)), np.zeros((2, robot.n))
        for link in np.unique(links):
            members = [(x, u, k) for (own, x, u, _), k in zip(cells, centres, strict=True) if own == link]
            radius = min(capsule.radius_m for capsule in by_link[link])
            spread[1, link] = fine_spacing_m / np.sqrt(12)
            turn[1, link] = spread[1, link] / radius
            spread[0, link] = max(_deviation([x - x[k] for x, _, k in members]), spread[1, link])
            turn[0, link] = max(_deviation([u - u[k] for _, u, k in members]), turn[1, link])
        return cls(
            cell_link=links,
            cell=fine[centre],
            cell_area=np.array([area.sum() for *_, area in cells]),
            cell_start=start,
            fine=fine,
            fine_area=np.concatenate([area for *_, area in cells]),
            spread_m=spread,
            turn=turn,
        )


def capsule_points(capsule: Capsule, spacing_m: float) -> tuple[Array, Array, Array]:
    """Return points (k, 3) [m], inward normals (k, 3) and areas (k,) [m^2] on the surface of a capsule.

    The points lie on rings around the axis; the areas of a ring's points add up to the ring's, so those of all points
    to the capsule's.
    """
    length, r = float(np.linalg.norm(capsule.p1_m - capsule.p0_m)), capsule.radius_m
    along = (capsule.p1_m - capsule.p0_m) / length if length > 0 else np.array([0.0, 0.0, 1.0])
    a, b = _tangents(along[None])
    rings: list[tuple[float, float, float]] = []  # height of the centre, slope of the normal, area
    polar = max(1, round(np.pi / 2 * r / spacing_m))
    edges = np.linspace(0.0, np.pi / 2, polar + 1)
    for low, high in pairwise(edges):
        middle, area = 0.5 * (low + high), 2 * np.pi * r**2 * (np.sin(high) - np.sin(low))
        rings += [(length, middle, area), (0.0, -middle, area)]
    barrel = max(1, round(length / spacing_m)) if length > 0 else 0
    rings += [(length * (i + 0.5) / barrel, 0.0, 2 * np.pi * r * length / barrel) for i in range(barrel)]
    points, normals, areas = [], [], []
    for height, slope, area in sorted(rings):
        count = max(1, round(2 * np.pi * r * np.cos(slope) / spacing_m))
        turn = 2 * np.pi * (np.arange(count) + 0.5) / count
        radial = np.outer(np.cos(turn), a[0]) + np.outer(np.sin(turn), b[0])  # (count, 3)
        outward = np.cos(slope) * radial + np.sin(slope) * along
        points.append(capsule.p0_m + height * along + r * outward)
        normals.append(-outward)
        areas.append(np.full(count, area / count))
    return np.concatenate(points), np.concatenate(normals), np.concatenate(areas)


def depth_in(capsule: Capsule, x: Array) -> Array:
    """Return how deep the points x (k, 3) lie inside a capsule (k,) [m]; negative outside."""
    axis = capsule.p1_m - capsule.p0_m
    square = float(axis @ axis)
    s = np.clip((x - capsule.p0_m) @ axis / square, 0.0, 1.0) if square > 0 else np.zeros(len(x))  # (k,)
    return np.asarray(capsule.radius_m - np.linalg.norm(x - capsule.p0_m - np.outer(s, axis), axis=1))


def _exposed(capsule: Capsule, capsules: list[Capsule], spacing_m: float) -> tuple[Array, Array, Array]:
    x, normal, area = capsule_points(capsule, spacing_m)
    free = np.ones(len(x), dtype=bool)
    for other in capsules:
        free &= (depth_in(other, x) <= 0) | (other is capsule)
    return x[free], normal[free], area[free]


def _nearest(x: Array, y: Array) -> Indices:
    """Return for each of x (k, 3) the index of the nearest of y."""
    return np.asarray(np.argmin(np.linalg.norm(x[:, None] - y[None], axis=2), axis=1))


def _deviation(offsets: list[Array]) -> float:
    """Return the standard deviation along one of two tangents of offsets [(k, 3), ...]."""
    return float(np.sqrt(np.mean(np.square(np.concatenate(offsets)).sum(axis=1)) / 2))


def _tangents(normal: Array) -> tuple[Array, Array]:
    """Return two unit vectors (k, 3) orthogonal to unit vectors (k, 3) and to each other."""
    helper = np.eye(3)[np.argmin(np.abs(normal), axis=1)]  # (k, 3)
    first = np.cross(normal, helper)
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    return first, np.cross(normal, first)
