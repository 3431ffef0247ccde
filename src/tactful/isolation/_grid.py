"""The evidence grid as records, the form in which the kernel reads and fills it."""

from __future__ import annotations

import functools
from dataclasses import dataclass
from typing import Any

import numpy as np

from tactful.dynamics import arm_record, kernels, motion_record
from tactful.isolation._config import IsolationConfig
from tactful.isolation._locate import mark_coverable
from tactful.isolation._surface import Surface
from tactful.robots import Robot

_POSES = 400

POINT = np.dtype([("x", "f8", (6,)), ("area", "f8")], align=True)
"""A fine point: position and inward normal in the link's frame, the area it stands for [m^2]."""

CAPSULE = np.dtype(
    [
        ("link", "i8"),
        ("ends", "f8", (2, 3)),  # in the link's frame [m]
        ("radius", "f8"),
        ("start", "f8", (3,)),  # in the base
        ("axis", "f8", (3,)),  # from start to end, in the base
        ("inverse_square", "f8"),  # of its length; 0 for a sphere
    ],
    align=True,
)


@functools.cache
def cell_dtype(m: int) -> np.dtype[np.void]:
    """Return the layout of a cell for m magnitudes of the force."""
    return np.dtype(
        [
            ("x", "f8", (6,)),  # position and inward normal in the link's frame
            ("area", "f8"),
            ("link", "i8"),
            ("start", "i8"),  # its fine points
            ("stop", "i8"),
            ("coverable", "i8"),  # whether a neighbouring link can come so near that it covers some of it
            ("parts", "f8", (m,)),  # log evidence by magnitude
            ("log_p", "f8"),  # log of the evidence times its share of the link's area
            ("refined", "i8"),
        ],
        align=True,
    )


@functools.cache
def atom_dtype(m: int) -> np.dtype[np.void]:
    """Return the layout of what the posterior consists of: fine points of refined cells, other cells as they are."""
    return np.dtype(
        [
            ("link", "i8"),
            ("level", "i8"),  # 0 for a cell, 1 for a fine point
            ("index", "i8"),
            ("area", "f8"),
            ("parts", "f8", (m,)),  # log evidence by magnitude
            ("p", "f8"),  # posterior probability
            ("x", "f8", (3,)),  # in the base [m]
        ],
        align=True,
    )


@functools.cache
def link_dtype(m: int) -> np.dtype[np.void]:
    """Return the layout of a link for m magnitudes of the force."""
    return np.dtype(
        [
            ("spread", "f8", (2,)),  # see Surface, by level
            ("turn", "f8", (2,)),
            ("P_exact", "f8", (6, 6)),  # U^T Sigma^-1 U
            ("g_exact", "f8", (6,)),  # U^T Sigma^-1 tau
            ("informed", "i8"),  # the finest level for which the following is known
            ("P", "f8", (2, m, 6, 6)),  # the same with the moments of the spread in Sigma
            ("g", "f8", (2, m, 6)),
            ("exponent", "f8", (2, m)),  # what is the same for all points: tau^T Sigma^-1 tau
            ("log_det", "f8", (2, m)),  # and log det(2 pi Sigma)
            ("area", "f8"),  # not covered by its neighbours [m^2]
            ("p", "f8"),  # posterior probability
        ],
        align=True,
    )


@functools.cache
def work_dtype(n: int, m: int) -> np.dtype[np.void]:
    """Return the layout of the settings, the result and the scratch of an update."""
    return np.dtype(
        [
            ("magnitudes", "f8", (m,)),  # [N]
            ("friction", "f8"),
            ("slack", "f8"),  # depth in another link from which a cell counts as hidden [m]
            ("refined", "i8"),  # how many cells at most
            ("log_evidence", "f8"),  # of a single contact
            ("misfit", "f8"),  # least exponent: squared Mahalanobis distance of tau from the best point
            ("point", "f8", (3,)),  # mean on the best link, in the base [m]
            ("point_cov", "f8", (3, 3)),
            ("force", "f8", (3,)),  # mean on the best link, in the base [N]
            ("force_cov", "f8", (3, 3)),
            ("size", "f8", (2,)),  # mean and variance of its magnitude
            ("V", "f8", (n, n)),  # upper, V V^T = Sigma
            ("y", "f8", (n,)),  # V^-1 tau
            ("square", "f8"),  # y . y
            ("log_det", "f8"),  # log det(2 pi Sigma)
            ("U", "f8", (n, 6)),  # V^-1 times what a wrench on one link does
            ("peak", "f8"),  # largest log evidence of a point and a magnitude so far
            ("dets", "f8", (m,)),
            ("x", "f8", (3,)),
            ("f", "f8", (3,)),
            ("K", "f8", (3, 3)),
            ("CK", "f8", (6, 3)),
        ],
        align=True,
    )


@dataclass(frozen=True, eq=False)
class Grid:
    """The records of one robot and configuration, as arguments of the kernel."""

    cells: Any
    fine: Any
    capsules: Any
    links: Any
    atoms: Any
    work: Any

    @classmethod
    def of(cls, robot: Robot, config: IsolationConfig) -> Grid:
        """Sample the surface of a robot.

        Raises:
            RobotError: if the surface of no moving link is known.
        """
        surface = Surface.of(robot, config.spacing_m, config.fine_spacing_m)
        m = len(config.magnitudes_n)
        fine: Any = np.zeros(len(surface.fine), POINT)
        fine["x"], fine["area"] = surface.fine, surface.fine_area
        cells: Any = np.zeros(len(surface.cell), cell_dtype(m))
        cells["x"], cells["area"], cells["link"] = surface.cell, surface.cell_area, surface.cell_link
        cells["start"], cells["stop"] = surface.cell_start[:-1], surface.cell_start[1:]
        capsules: Any = np.zeros(len(robot.capsules), CAPSULE)
        capsules["link"] = [capsule.link for capsule in robot.capsules]
        capsules["ends"] = [(capsule.p0_m, capsule.p1_m) for capsule in robot.capsules]
        capsules["radius"] = [capsule.radius_m for capsule in robot.capsules]
        links: Any = np.zeros(robot.n, link_dtype(m))
        links["spread"], links["turn"] = surface.spread_m.T, surface.turn.T
        room = len(cells) + config.refined_cells * int((cells["stop"] - cells["start"]).max())
        work: Any = np.zeros(1, work_dtype(robot.n, m))
        work["magnitudes"], work["friction"] = config.magnitudes_n, config.friction
        work["slack"], work["refined"] = config.spacing_m / 2, config.refined_cells
        _mark_coverable(robot, cells, capsules, work[0], 0.75 * config.spacing_m)
        return cls(cells, fine, capsules, links, np.zeros(room, atom_dtype(m)), work[0])


def _mark_coverable(robot: Robot, cells: Any, capsules: Any, work: Any, margin_m: float) -> None:
    """Mark the cells that a neighbouring link covers in one of many poses, so that the others need no look later."""
    rng = np.random.default_rng(0)
    arm: Any = arm_record(robot)
    motion: Any = motion_record(robot.n)
    low, high = np.maximum(robot.lower, -np.pi), np.minimum(robot.upper, np.pi)
    for _ in range(_POSES):
        kernels.place(arm[0], motion[0], rng.uniform(low, high))
        mark_coverable(motion[0], cells, capsules, work, margin_m)
