"""Which columns of a file make which channel, and the recording that follows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from tactful.recordings._errors import RecordingError
from tactful.recordings._label import Label
from tactful.recordings._table import Table, short_list


@dataclass(frozen=True)
class Source:
    """One column of a channel: a column of the file, or one of its block, times a factor that gives SI."""

    column: str
    factor: float = 1.0
    component: int | None = None


@dataclass(frozen=True)
class LabelSource:
    """A column that marks rows: text that names the kind, or a flag where `kind` is given."""

    column: str
    kind: str | None = None


@dataclass
class Plan:
    """How a table becomes a recording.

    Attributes:
        name: name of the layout that made the plan; empty for the canonical one.
        time: the column of time.
        time_factor: seconds in its unit; None to judge by the median step.
        relative: whether time starts at zero in the first row.
        channels: canonical name -> its columns.
        labels: columns that mark rows.
        notes: what was assumed.
        explicit: whether the units were stated, so that none is guessed.
    """

    name: str
    time: str
    time_factor: float | None
    relative: bool = False
    channels: dict[str, list[Source]] = field(default_factory=dict)
    labels: list[LabelSource] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    explicit: bool = False

    def unused(self, table: Table) -> list[str]:
        """Columns of the file that nothing reads."""
        used = {self.time, *(label.column for label in self.labels)}
        used.update(source.column for sources in self.channels.values() for source in sources)
        return [name for name in table.names if name not in used]

    def values(self, table: Table, channel: str) -> NDArray[np.float64]:
        """The channel's values (N, k) in SI units."""
        sources = self.channels[channel]
        whole = [Source(sources[0].column, 1.0, i) for i in range(len(sources))]
        if sources == whole and table.widths.get(sources[0].column) == len(sources):
            return np.ascontiguousarray(table.column(sources[0].column))
        values = np.empty((table.rows, len(sources)))
        block_name, block = "", np.empty(0)
        for i, source in enumerate(sources):
            if source.column != block_name:
                block_name, block = source.column, table.column(source.column)
            column = block if block.ndim == 1 else _component(table, block, source)
            np.multiply(column, source.factor, out=values[:, i])
        return values


def _component(table: Table, block: NDArray[np.float64], source: Source) -> NDArray[np.float64]:
    component = 0 if source.component is None and block.shape[1] == 1 else source.component
    if component is None or component >= block.shape[1]:
        raise RecordingError(
            f"column {source.column!r} holds {block.shape[1]} values a row: name the whole block or another column",
            path=table.path,
            column=source.column,
        )
    return block[:, component]


def note_unused(names: Sequence[str]) -> list[str]:
    """A note on the columns that were not read."""
    return [f"columns not read: {short_list(names, 12)}"] if names else []


def labels_from(table: Table, source: LabelSource, t: NDArray[np.float64]) -> list[Label]:
    """Intervals over which a column says the same; each ends with the stamp of its last row."""
    if source.kind is None:
        kinds = [kind.strip() for kind in table.load_text(source.column)]
        kinds = ["" if kind.casefold() in _NOTHING else kind for kind in kinds]
    else:
        flags = table.column(source.column)
        kinds = [source.kind if flag else "" for flag in np.nan_to_num(flags, nan=0.0).tolist()]
    labels = []
    start = 0
    for i in range(1, len(kinds) + 1):
        if i < len(kinds) and kinds[i] == kinds[start]:
            continue
        if kinds[start]:
            stamps = t[start:i][np.isfinite(t[start:i])]
            if stamps.size:
                labels.append(Label(kinds[start], float(stamps.min()), float(stamps.max())))
        start = i
    return labels


_NOTHING = frozenset({"", "0", "none", "free", "nan", "no", "false", "-"})
