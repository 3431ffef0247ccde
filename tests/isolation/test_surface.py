"""The sampled surface: it has to be the capsules', neither more nor less."""

from __future__ import annotations

import numpy as np
import pytest

from tactful import Robot
from tactful.isolation._surface import Surface, capsule_points, depth_in
from tactful.robots import Capsule


@pytest.mark.parametrize("length", [0.0, 0.005, 0.3])
@pytest.mark.parametrize("spacing_m", [0.05, 0.01])
def test_capsule_points_cover_the_capsule(length: float, spacing_m: float) -> None:
    """Areas that do not add up would favour some links over others."""
    capsule = Capsule(
        0, np.array([0.1, -0.2, 0.3]), np.array([0.1, -0.2, 0.3]) + length * np.array([0.6, 0, 0.8]), 0.06
    )
    x, inward, area = capsule_points(capsule, spacing_m)
    assert area.sum() == pytest.approx(4 * np.pi * 0.06**2 + 2 * np.pi * 0.06 * length)
    np.testing.assert_allclose(depth_in(capsule, x), 0.0, atol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(inward, axis=1), 1.0)
    assert (depth_in(capsule, x + 0.01 * inward) > 0.0099).all()
    np.testing.assert_allclose((area[:, None] * inward).sum(axis=0), 0.0, atol=1e-12)  # closed


@pytest.mark.parametrize("name", Robot.names())
def test_cells_hold_every_fine_point_once(name: str) -> None:
    """A refined cell is replaced by its fine points: their area has to be the cell's."""
    surface = Surface.of(Robot.load(name), 0.05, 0.01)
    assert surface.cell_start[0] == 0
    assert surface.cell_start[-1] == len(surface.fine)
    sums = np.add.reduceat(surface.fine_area, surface.cell_start[:-1])
    np.testing.assert_allclose(sums, surface.cell_area)
    assert (np.diff(surface.cell_link) >= 0).all()
    assert (surface.spread_m[0] < 0.05 / np.sqrt(12) * 1.3).all()


def test_surface_inside_the_same_link_is_left_out() -> None:
    """Where two capsules of a link overlap there is no surface to touch."""
    panda = Robot.load("panda")
    surface = Surface.of(panda, 0.05, 0.01)
    for link in range(panda.n):
        own = [capsule for capsule in panda.capsules if capsule.link == link]
        cells = np.flatnonzero(surface.cell_link == link)
        x = surface.fine[surface.cell_start[cells[0]] : surface.cell_start[cells[-1] + 1], :3]
        assert max(depth_in(capsule, x).max() for capsule in own) < 1e-9
