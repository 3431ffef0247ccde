"""The layout that Tactful writes itself, and the usual spellings of the same columns."""

from __future__ import annotations

import re
from dataclasses import replace
from itertools import product

from tactful.recordings._channels import CHANNELS
from tactful.recordings._errors import RecordingError
from tactful.recordings._plan import LabelSource, Plan, Source
from tactful.recordings._table import Table, short_list

# column name -> factor to seconds, None where the name does not say the unit
TIME: dict[str, float | None] = {
    "time": None, "t": None, "timestamp": None, "stamp": None,
    "time_s": 1.0, "t_s": 1.0, "timestamp_s": 1.0, "time [s]": 1.0, "time_ms": 1e-3, "t_ms": 1e-3,
    "timestamp_ms": 1e-3, "time [ms]": 1e-3, "time_us": 1e-6, "t_us": 1e-6, "timestamp_us": 1e-6,
    "time_ns": 1e-9, "t_ns": 1e-9, "timestamp_ns": 1e-9,
}  # fmt: skip

# the first spelling that a file has is taken
SPELLINGS: dict[str, tuple[str, ...]] = {
    "q": ("q", "actual_q", "joint_position", "joint_positions", "position"),
    "dq": ("dq", "qd", "actual_qd", "joint_velocity", "joint_velocities", "velocity"),
    "tau": ("tau_j", "tau", "joint_torque", "joint_torques", "torque", "effort"),
    "tau_ext": ("tau_ext", "tau_ext_hat_filtered"),
    "wrench": ("wrench", "f_ext", "o_f_ext_hat_k"),
    "wrench_ft": ("wrench_ft", "ft_wrench", "ft"),
    "jacobian": ("jacobian",),
    "current": ("current", "actual_current", "motor_current"),
}

# libfranka's names come with libfranka's sign: what the robot exerts on the environment
_LIBFRANKA = frozenset({"tau_ext_hat_filtered", "o_f_ext_hat_k"})

_AXES = (("f{x}", "t{x}"), ("f{x}", "m{x}"), ("f_{x}", "t_{x}"), ("f_{x}", "m_{x}"), ("force_{x}", "torque_{x}"))
_PREFIXES = {"wrench": ("", "wrench_", "f_ext_"), "wrench_ft": ("ft_", "ft_wrench_", "wrench_ft_")}
KINDS = ("contact", "collision", "cooperation", "expected_impact", "unexpected_impact")


def plan(table: Table) -> Plan:
    """Columns by their canonical names, or their usual spellings.

    Raises:
        RecordingError: no column of time, none that can be monitored, a joint is missing.
    """
    names = {name.strip().casefold(): name for name in table.names}
    if not table.header:
        raise RecordingError(
            f"there is no header over the {len(table.names)} columns: give a mapping that says which column is what",
            path=table.path,
        )
    time = next((name for name in TIME if name in names), None)
    if time is None:
        raise RecordingError(
            f"there is no time column: name it time [s], or say which one it is in a mapping; it has "
            f"{short_list(table.names)}",
            path=table.path,
            column="time",
        )
    result = Plan(name="", time=names[time], time_factor=TIME[time], explicit=False)
    for channel in CHANNELS:
        sources = _joints(table, names, channel, result)
        if not sources and channel in _PREFIXES:
            sources = _axes(names, channel, result)
        if sources:
            result.channels[channel] = sources
    if not result.channels:
        raise RecordingError(
            "no column has a name that is known (q_0, dq_0, tau_J_0, tau_ext_0, wrench_0, ...): rename them or give a "
            f"mapping; it has {short_list(table.names)}",
            path=table.path,
        )
    result.labels = [LabelSource(names["label"])] if "label" in names else []
    result.labels += [LabelSource(names[kind], kind) for kind in KINDS if kind in names]
    return result


def _joints(table: Table, names: dict[str, str], channel: str, result: Plan) -> list[Source]:
    for spelling in SPELLINGS[channel]:
        sources = _spelled(table, names, channel, spelling, result)
        if sources and spelling in _LIBFRANKA:
            result.notes.append(f"{channel}: {spelling} counts what the robot exerts; its sign is turned")
            return [replace(source, factor=-1.0) for source in sources]
        if sources:
            return sources
    return []


def _spelled(table: Table, names: dict[str, str], channel: str, spelling: str, result: Plan) -> list[Source]:
    if spelling in names and names[spelling] in table.widths:
        return [Source(names[spelling], 1.0, i) for i in range(table.widths[names[spelling]])]
    pattern = re.compile(rf"{re.escape(spelling)}(?:_|\.|)\[?(\d{{1,4}})\]?$")
    found = {int(match[1]): name for key, name in names.items() if (match := pattern.match(key))}
    if channel == "jacobian" and not found:
        found = _grid(names, spelling)
    if not found:
        return []
    first = min(found)
    if first == 1:
        result.notes.append(f"{channel}: {spelling}_1 is taken for the first joint, as there is no {spelling}_0")
    for i in range(1 if first == 1 else 0, max(found) + 1):
        if i not in found:
            raise _gap(table, channel, spelling, i)
    return [Source(found[i]) for i in sorted(found)]


def _grid(names: dict[str, str], spelling: str) -> dict[int, str]:
    pattern = re.compile(rf"{re.escape(spelling)}_(\d{{1,2}})_(\d{{1,4}})$")
    cells = {(int(match[1]), int(match[2])): name for key, name in names.items() if (match := pattern.match(key))}
    columns = max((column for _, column in cells), default=-1) + 1
    return {row * columns + column: name for (row, column), name in cells.items()}


def _gap(table: Table, channel: str, spelling: str, index: int) -> RecordingError:
    column = f"{spelling}_{index}"
    return RecordingError(
        f"column {column!r} is missing between its neighbours: a joint left out would shift the others",
        path=table.path,
        column=column,
        channel=channel,
    )


def _axes(names: dict[str, str], channel: str, result: Plan) -> list[Source]:
    forces: list[str] = []
    for prefix, (force, torque) in product(_PREFIXES[channel], _AXES):
        columns = [prefix + style.format(x=axis) for style in (force, torque) for axis in "xyz"]
        if all(column in names for column in columns):
            return [Source(names[column]) for column in columns]
        if not forces and all(column in names for column in columns[:3]):
            forces = columns[:3]
    if not forces:
        return []
    result.notes.append(f"{channel}: the file has its forces only, its torques stand as 0")
    return [Source(names[column]) for column in forces] + [Source(names[forces[0]], 0.0)] * 3
