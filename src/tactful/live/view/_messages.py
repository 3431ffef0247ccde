"""What goes between the loop and the page, which run in processes of their own."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tactful.monitor import ContactEvent, MonitorConfig
from tactful.robots import Robot

Array = NDArray[np.float64]

BIN_S = 0.02
"""Of all samples in so long, the page draws the one with the highest level [s]."""


class Trace(NamedTuple):
    """What is drawn over time: N rows, the highest of each 20 ms."""

    t: Array
    """(N,) [s]."""
    level: Array
    """(N, 3), relative to their thresholds; in fast mode the first alone counts."""
    force_n: Array
    """(N, 3) at the tip, base axes [N]."""
    tau_ext: Array
    """(N, n) [Nm]."""
    state: Array
    """(N,), see `Timeline.trace`."""


@dataclass(frozen=True, kw_only=True)
class Setup:
    """What is watched."""

    source: str
    robot: Robot | None
    model: str | None
    """Where the arm's file is, if it has one: it may name meshes."""
    config: MonitorConfig
    commanded: bool
    """Whether the arm is commanded from here, so that it can react."""
    workshop: bool
    """Whether it can be touched, paused and started anew."""
    speed: float = 0.0
    """Robot time that is to pass in a second, in simulation; 0 where nobody has set it."""
    recorded: bool = False
    """Whether it is a recording, whose past follows."""
    policy: str | None = None
    obstacle_m: Array | None = None
    in_the_way_m: Array | None = None
    obstacle_size_m: tuple[float, float, float] = (0.1, 0.1, 0.1)
    way_m: Array | None = None
    """(k, 3), where the tip is to go [m]."""


@dataclass(frozen=True, kw_only=True)
class Frame:
    """What has come since the frame before."""

    t: float
    q: Array | None
    trace: Trace
    events: tuple[tuple[float, ContactEvent], ...]
    reaction: str
    ready: bool
    degraded: bool
    samples: int
    lost: int
    late: int | None
    """None where no sample can be late."""
    computing_s: float
    """What 99.9 % of the samples took at most [s]."""
    paused: bool = False
    recording: str | None = None
    notice: str | None = None
    obstacle_m: Array | None = None
    hand: tuple[Array, Array] | None = None
    taught: int = 0
    way_m: Array | None = None
    """(k, 3), where the tip is to go, when that has changed [m]."""


@dataclass(frozen=True, kw_only=True)
class Past:
    """A whole recording, as the monitor saw it."""

    trace: Trace
    q: Array | None
    """(N, n) [rad], of the rows of the trace."""
    events: tuple[ContactEvent, ...]


@dataclass(frozen=True)
class Wish:
    """What the user wants: its name, and what it needs."""

    name: str
    values: tuple[Any, ...] = ()


def thin(rows: Any, threshold: Array) -> tuple[Trace, NDArray[np.intp]]:
    """Return of rows of `Timeline.trace` those to draw, with their indices; `threshold` (3,) is that of the levels."""
    t = rows["t"]
    if not len(t):
        rows = rows[:0]
        index = np.zeros(0, dtype=np.intp)
    else:
        relative = (rows["level"] / threshold).max(axis=1)
        starts = np.flatnonzero(np.diff(np.floor(t / BIN_S), prepend=-np.inf) != 0)
        index = np.array([a + np.argmax(relative[a:b]) for a, b in zip(starts, [*starts[1:], len(t)], strict=True)])
    kept = rows[index]
    trace = Trace(
        kept["t"].copy(),
        kept["level"] / threshold,
        kept["wrench"][:, :3].copy(),
        kept["tau_ext"].copy(),
        kept["state"].astype(float),
    )
    return trace, index
