"""Layouts: how the columns of other people's files become channels, written in TOML."""

from __future__ import annotations

import math
import re
import tomllib
from collections.abc import Mapping
from difflib import get_close_matches
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Annotated, Any, Literal, Self, TypeVar

from pydantic import BaseModel, ConfigDict, Field, StringConstraints, ValidationError, model_validator

from tactful.recordings._channels import CHANNELS, joints_of
from tactful.recordings._errors import RecordingError
from tactful.recordings._plan import LabelSource, Plan, Source
from tactful.recordings._table import Table

TIME_UNITS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}
_ANGLE = {"rad": 1.0, "deg": math.pi / 180.0}
_RATE = {"rad/s": 1.0, "deg/s": math.pi / 180.0, **_ANGLE}
_TORQUE = {"Nm": 1.0, "mNm": 1e-3, "A": 1.0}
_FORCE = {"N": 1.0, "mN": 1e-3, "kN": 1e3, "Nm": 1.0, "mNm": 1e-3}
UNITS: dict[str, dict[str, float]] = {
    "q": _ANGLE,
    "dq": _RATE,
    "tau": _TORQUE,
    "tau_ext": _TORQUE,
    "wrench": _FORCE,
    "wrench_ft": _FORCE,
    "jacobian": {"": 1.0},
    "current": {"A": 1.0, "mA": 1e-3},
}
"""Units that each channel may be given in, with the factor to SI."""

T = TypeVar("T")
Name = Annotated[str, StringConstraints(min_length=1, pattern=r"^[a-z0-9][a-z0-9_-]*$")]
Column = Annotated[str, StringConstraints(min_length=1)] | Annotated[int, Field(ge=0)]


class _Part(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid")


class Range(_Part):
    """Neighbouring columns by place: `count` of them from `first`, counted from 0."""

    first: int = Field(ge=0)
    count: int = Field(ge=1, le=4096)


class Match(_Part):
    """By what a file of this layout is known.

    Attributes:
        columns: names that its header has to have.
        without: names that it must not have.
        headerless: number of columns of a file without a header.
    """

    columns: tuple[str, ...] = ()
    without: tuple[str, ...] = ()
    headerless: int | None = Field(default=None, ge=1)


class TimeColumn(_Part):
    """Where time stands.

    Attributes:
        column: its name, or its place from 0.
        unit: `s`, `ms`, `us` or `ns`.
        relative: let time start at 0 in the first row.
    """

    column: Column
    unit: Literal["s", "ms", "us", "ns"] = "s"
    relative: bool = False


class ChannelColumns(_Part):
    """Where a channel stands.

    Attributes:
        columns: a name, a pattern such as `q_{i}` (i counts from 0, or from 1 where 0 is missing), a list of names or
            places in the order in which the channel wants them, or `{ first = 1, count = 6 }`.
        unit: of all columns, or of each; SI without it.
        scale: factor on all columns, or on each, besides the unit. A negative one turns the sign; with the unit `A` it
            is the torque constant [Nm/A] of each joint.
    """

    columns: str | list[Column] | Range
    unit: str | list[str] | None = None
    scale: float | list[float] = 1.0

    @model_validator(mode="after")
    def _check(self) -> Self:
        scales = self.scale if isinstance(self.scale, list) else [self.scale]
        if not all(math.isfinite(scale) and scale != 0.0 for scale in scales):
            raise ValueError(f"scale is {self.scale}, expected finite factors other than 0")
        return self


class LabelColumn(_Part):
    """A column that marks rows: text that names the kind, or, with `kind`, a flag that is not 0."""

    column: Column
    kind: str | None = None


class Layout(_Part):
    """How the columns of a file become channels.

    Attributes:
        name: short name; it stands in `Recording.format`.
        title: what writes such files.
        time: the column of time.
        channels: canonical name -> columns.
        labels: columns that mark rows.
        match: by what such a file is known; only for layouts that come with the package.
        notes: what a user has to know about such files; they go into `Recording.notes`.
    """

    name: Name
    title: str = ""
    time: TimeColumn
    channels: dict[str, ChannelColumns] = Field(min_length=1)
    labels: tuple[LabelColumn, ...] = ()
    match: Match | None = None
    notes: tuple[str, ...] = ()

    @model_validator(mode="after")
    def _check(self) -> Self:
        for name, channel in self.channels.items():
            if name not in CHANNELS:
                near = get_close_matches(name.casefold(), CHANNELS, n=1, cutoff=0.4)
                hint = f"did you mean {near[0]!r}?" if near else f"use one of {', '.join(CHANNELS)}"
                raise ValueError(f"unknown channel {name!r}: {hint}")
            units = channel.unit if isinstance(channel.unit, list) else [channel.unit]
            for unit in units:
                if unit is not None and unit not in UNITS[name]:
                    raise ValueError(f"channel {name!r} has unit {unit!r}: use {', '.join(UNITS[name])}")
                if unit == "A" and name != "current" and channel.scale == 1.0:
                    raise ValueError(f"channel {name!r} is in A: give its torque constants [Nm/A] in scale")
        return self

    def fits(self, table: Table) -> bool:
        """Whether the table looks like a file of this layout."""
        if self.match is None:
            return False
        if not table.header:
            return self.match.headerless == len(table.names)
        names = set(table.names)
        return (
            bool(self.match.columns) and names.issuperset(self.match.columns) and names.isdisjoint(self.match.without)
        )

    def plan(self, table: Table) -> Plan:
        """Its columns in this table.

        Raises:
            RecordingError: a column is missing, a unit or scale list has another length than the columns.
        """
        result = Plan(
            name=self.name,
            time=_name(table, self.time.column),
            time_factor=TIME_UNITS[self.time.unit],
            relative=self.time.relative,
            notes=list(self.notes),
            explicit=True,
        )
        if self.time.unit != "s":
            result.notes.append(f"time in {self.time.unit}, converted to s (layout {self.name})")
        for name, channel in self.channels.items():
            sources = _sources(table, channel.columns)
            joints_of(name, len(sources), str(table.path))
            units = _each(channel.unit or "", len(sources), name, "unit", table)
            scales = _each(channel.scale, len(sources), name, "scale", table)
            result.channels[name] = [
                Source(source.column, scale * (UNITS[name][unit] if unit else 1.0), source.component)
                for source, unit, scale in zip(sources, units, scales, strict=True)
            ]
        result.labels = [LabelSource(_name(table, label.column), label.kind) for label in self.labels]
        return result


def load(mapping: str | Path | Mapping[str, Any]) -> Layout:
    """A layout from a TOML file, from the same as a dict, or one that comes with the package, by name.

    Raises:
        RecordingError: no such file or name, no TOML, or a key or value that is not allowed.
    """
    if isinstance(mapping, Mapping):
        return _validated(dict(mapping), Path("mapping"))
    for layout in builtin():
        if layout.name == str(mapping):
            return layout
    path = Path(mapping)
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, ValueError) as error:
        names = ", ".join(layout.name for layout in builtin())
        why = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
        raise RecordingError(
            f"the mapping cannot be read ({why}): give a TOML file or one of {names}", path=path
        ) from None
    return parse(text, path)


def parse(text: str, path: Path) -> Layout:
    """A layout from TOML text; the name defaults to that of the file."""
    try:
        data = tomllib.loads(text)
    except (tomllib.TOMLDecodeError, RecursionError) as error:
        raise RecordingError(f"the mapping is no TOML: {error}", path=path) from None
    return _validated(data, path)


def _validated(data: dict[str, Any], path: Path) -> Layout:
    stem = re.sub(r"[^a-z0-9_-]+", "-", path.stem.lower()).strip("-_") or "mapping"
    try:
        return Layout.model_validate({"name": stem, **data})
    except ValidationError as error:
        raise RecordingError(_explain(error), path=path) from None


@cache
def builtin() -> tuple[Layout, ...]:
    """The layouts that come with the package, one a file in `layouts/`."""
    entries = sorted(files("tactful.recordings").joinpath("layouts").iterdir(), key=lambda entry: entry.name)
    return tuple(
        parse(entry.read_text(encoding="utf-8"), Path(entry.name)) for entry in entries if entry.name.endswith(".toml")
    )


def find(table: Table) -> Layout | None:
    """The layout that the table's columns show, or None."""
    return next((layout for layout in builtin() if layout.fits(table)), None)


def _name(table: Table, column: str | int) -> str:
    if isinstance(column, int):
        if column >= len(table.names):
            raise RecordingError(
                f"there is no column {column}: it has {len(table.names)}, counted from 0",
                path=table.path,
                column=column,
            )
        return table.names[column]
    if column not in table.names:
        raise table.missing(column)
    return column


def _sources(table: Table, columns: str | list[Column] | Range) -> list[Source]:
    if isinstance(columns, Range):
        columns = list(range(columns.first, columns.first + columns.count))
    if isinstance(columns, list):
        return [Source(_name(table, column)) for column in columns]
    if "{i}" not in columns:
        name = _name(table, columns)
        return [Source(name, 1.0, i) for i in range(table.widths[name])] if name in table.widths else [Source(name)]
    before, after = columns.split("{i}", 1)
    names = set(table.names)
    first = 0 if f"{before}0{after}" in names else 1
    found: list[Source] = []
    while (name := f"{before}{first + len(found)}{after}") in names:
        found.append(Source(name))
    if not found:
        raise table.missing(f"{before}0{after}")
    later = re.compile(re.escape(before) + r"(\d{1,4})" + re.escape(after))
    last = max((int(match[1]) for name in names if (match := later.fullmatch(name))), default=0)
    if last >= first + len(found):
        raise table.missing(f"{before}{first + len(found)}{after}")
    return found


def _each(value: T | list[T], n: int, channel: str, what: str, table: Table) -> list[T]:
    if not isinstance(value, list):
        return [value] * n
    if len(value) != n:
        raise RecordingError(
            f"mapping: channel {channel!r} has {n} columns but {len(value)} values of {what}: give one, or one each",
            path=table.path,
            channel=channel,
        )
    return value


def _explain(error: ValidationError) -> str:
    first: Any = min(error.errors(), key=lambda entry: entry["type"] != "extra_forbidden")
    place = ".".join(str(part) for part in first["loc"] if part not in ("str", "list", "Range", "int"))
    if first["type"] == "extra_forbidden":
        allowed = _keys(first["loc"][:-1])
        near = get_close_matches(str(first["loc"][-1]), allowed, n=1, cutoff=0.5)
        hint = f"did you mean {near[0]!r}?" if near else f"allowed are {', '.join(allowed)}"
        return f"mapping: unknown key {place!r}: {hint}"
    return f"mapping: {place + ': ' if place else ''}{first['msg'].removeprefix('Value error, ')}"


def _keys(loc: tuple[int | str, ...]) -> list[str]:
    parts: dict[str, type[_Part]] = {
        "time": TimeColumn,
        "channels": ChannelColumns,
        "labels": LabelColumn,
        "match": Match,
    }
    model = Range if "Range" in loc else parts.get(str(loc[0]), Layout) if loc else Layout
    return list(model.model_fields)
