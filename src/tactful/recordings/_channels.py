"""The canonical channels: their names, units and widths."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from difflib import get_close_matches
from types import MappingProxyType
from typing import Literal

from tactful.recordings._errors import RecordingError


@dataclass(frozen=True)
class Channel:
    """What a canonical channel holds.

    Attributes:
        name: the symbol of the literature.
        title: one phrase for people.
        units: one unit for all columns, or one for each.
        width: `n` for one column a joint, `6n` for a Jacobian, `6` for a wrench.
    """

    name: str
    title: str
    units: tuple[str, ...]
    width: Literal["n", "6n", "6"]

    def columns(self, n_columns: int) -> tuple[str, ...]:
        """Names of its columns in a file, `q_0, q_1, ...`."""
        return tuple(f"{self.name}_{i}" for i in range(n_columns))


_WRENCH = ("N", "N", "N", "Nm", "Nm", "Nm")

CHANNELS: Mapping[str, Channel] = MappingProxyType(
    {
        channel.name: channel
        for channel in (
            Channel("q", "joint position", ("rad",), "n"),
            Channel("dq", "joint velocity", ("rad/s",), "n"),
            Channel("tau", "measured joint torque, gravity included", ("Nm",), "n"),
            Channel("tau_ext", "external joint torque, the robot's own estimate", ("Nm",), "n"),
            Channel("wrench", "external wrench at the tip, base axes", _WRENCH, "6"),
            Channel("wrench_ft", "wrench of a force/torque sensor", _WRENCH, "6"),
            Channel("jacobian", "Jacobian of the tip, row-major 6 x n", ("",), "6n"),
            Channel("current", "motor current", ("A",), "n"),
        )
    }
)
"""Every channel that a recording can hold, by name."""


def check_name(name: str, path: str | None = None) -> None:
    """Raise a `RecordingError` that suggests the nearest name unless `name` is a canonical channel."""
    if name in CHANNELS:
        return
    near = get_close_matches(name.casefold(), CHANNELS, n=1, cutoff=0.4)
    hint = f"did you mean {near[0]!r}?" if near else f"use one of {', '.join(CHANNELS)}"
    raise RecordingError(f"unknown channel {name!r}: {hint}", path=path, channel=name)


def joints_of(name: str, n_columns: int, path: str | None = None) -> int | None:
    """Number of joints that a channel with `n_columns` columns speaks of; None for a wrench."""
    width = CHANNELS[name].width
    if width == "6":
        if n_columns != 6:
            raise RecordingError(
                f"channel {name!r} has {n_columns} columns, a wrench has 6 (fx fy fz tx ty tz)", path=path, channel=name
            )
        return None
    if n_columns == 0 or (width == "6n" and n_columns % 6):
        needs = "a multiple of 6, row-major" if width == "6n" else "at least one"
        raise RecordingError(f"channel {name!r} has {n_columns} columns, expected {needs}", path=path, channel=name)
    return n_columns // 6 if width == "6n" else n_columns
