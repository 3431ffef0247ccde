"""What really touched the arm."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict, dataclass, field
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from tactful.recordings import Label

Array = NDArray[np.float64]

VISIBLE_N = 1.0
"""The force from which a contact can be expected to be seen [N]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class TrueContact:
    """A contact as it was. Forces act on the robot, base axes."""

    kind: Literal["collision", "cooperation"]
    """What it was: a fixture collides, a hand cooperates."""
    name: str
    """The fixture, or the hand."""
    link: int
    """Index of the link that was touched with the largest impulse."""
    touch_s: float
    """Time of the first sample with a force [s]."""
    visible_s: float | None
    """Time of the first sample with at least 1 N [s]; None if there is none."""
    end_s: float
    """Time of the last sample with a force [s]."""
    peak_force_n: float
    """Largest magnitude of the force [N]."""

    def to_dict(self) -> dict[str, Any]:
        """Return plain data."""
        return asdict(self)

    def label(self) -> Label:
        """Return the interval from the touch to the end as a label of a recording."""
        return Label(self.kind, self.touch_s, self.end_s, self.link, self.visible_s, self.peak_force_n)


@dataclass(slots=True)
class TouchLog:
    """The samples in which one fixture or hand touched the arm."""

    kind: Literal["collision", "cooperation"]
    name: str
    times: list[float] = field(default_factory=list)
    links: list[int] = field(default_factory=list)
    forces: list[float] = field(default_factory=list)

    def add(self, t: float, link: int, force_n: float) -> None:
        """Note a force on a link at the time t [s]."""
        if force_n > 0:
            self.times.append(t)
            self.links.append(link)
            self.forces.append(force_n)

    def contacts(self, bounce_s: float) -> Iterator[TrueContact]:
        """Yield the contacts; touches that lie at most `bounce_s` [s] apart are one."""
        if not self.times:
            return
        t, links, forces = np.array(self.times), np.array(self.links), np.array(self.forces)
        cuts = np.flatnonzero(np.diff(t) > bounce_s) + 1
        for span in np.split(np.arange(len(t)), cuts):
            visible = span[forces[span] >= VISIBLE_N]
            yield TrueContact(
                kind=self.kind,
                name=self.name,
                link=int(np.argmax(np.bincount(links[span], weights=forces[span]))),
                touch_s=float(t[span[0]]),
                visible_s=float(t[visible[0]]) if len(visible) else None,
                end_s=float(t[span[-1]]),
                peak_force_n=float(forces[span].max()),
            )
