"""A recording: canonical channels over time, with labels and what was found on reading."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from types import MappingProxyType
from typing import Any, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tactful.recordings._channels import check_name, joints_of
from tactful.recordings._errors import RecordingError
from tactful.recordings._label import Label
from tactful.recordings._quality import Quality

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Recording:
    """What a robot's sensors said, row by row, in SI units and radians.

    Rows stand as they stand in the file: NaN, repeated and backward rows are counted in `quality`, not removed. The
    arrays are read-only views; a float64 C-contiguous input is not copied.

    Attributes:
        t: time stamps (N,) [s].
        channels: canonical name -> values (N, k), see `CHANNELS`. Torques and wrenches act from the environment on the
            robot, except `tau`, which the joints apply: M qdd + C qd + g = tau + tau_ext.
        labels: marked intervals.
        source: the file it was read from, or whatever says where it comes from.
        format: how it was stored.
        notes: what was converted, assumed, ignored or found on reading, a line each.

    Raises:
        RecordingError: no rows, a channel that is unknown, of the wrong length or shape, or channels that disagree on
            the number of joints.
    """

    t: Array
    channels: Mapping[str, Array]
    labels: tuple[Label, ...] = ()
    source: str = ""
    format: str = "memory"
    notes: tuple[str, ...] = field(default=())

    def __post_init__(self) -> None:
        place = self.source or None
        t = _read_only(self.t, "t", place)
        if t.ndim != 1:
            raise RecordingError(f"t has shape {t.shape}, expected (N,) time stamps [s]", path=place)
        if t.size == 0:
            raise RecordingError("there are no rows: a recording has at least one", path=place)
        channels: dict[str, Array] = {}
        joints: dict[str, int] = {}
        for name, values in self.channels.items():
            check_name(name, place)
            array = _read_only(values, name, place)
            if array.ndim != 2 or len(array) != len(t):
                raise RecordingError(
                    f"channel {name!r} has shape {array.shape}, expected ({len(t)}, k) as t has {len(t)} rows",
                    path=place,
                    channel=name,
                )
            n = joints_of(name, array.shape[1], place)
            if n is not None:
                joints[name] = n
            channels[name] = array
        if len(set(joints.values())) > 1:
            counts = ", ".join(f"{name} {n}" for name, n in joints.items())
            raise RecordingError(f"channels disagree on the number of joints: {counts}; give all of them", path=place)
        labels = tuple(self.labels)
        for label in cast("tuple[object, ...]", labels):
            if not isinstance(label, Label):
                raise RecordingError(f"labels holds {label!r:.60}, expected Label objects", path=place)
        for name, value in (("t", t), ("channels", MappingProxyType(channels)), ("labels", labels)):
            object.__setattr__(self, name, value)
        object.__setattr__(self, "notes", tuple(str(note) for note in self.notes))

    def __reduce__(self) -> tuple[Any, ...]:
        return Recording, (self.t, dict(self.channels), self.labels, self.source, self.format, self.notes)

    def __len__(self) -> int:
        return len(self.t)

    def __repr__(self) -> str:
        names = ", ".join(f"{name}({values.shape[1]})" for name, values in self.channels.items())
        return f"<Recording {self.source or self.format}: {len(self)} rows, {self.duration_s:.3g} s, {names}>"

    @property
    def q(self) -> Array | None:
        """Joint positions (N, n) [rad], or None."""
        return self.channels.get("q")

    @property
    def dq(self) -> Array | None:
        """Joint velocities (N, n) [rad/s], or None."""
        return self.channels.get("dq")

    @property
    def tau(self) -> Array | None:
        """Measured joint torques (N, n) [Nm], gravity included, or None."""
        return self.channels.get("tau")

    @property
    def tau_ext(self) -> Array | None:
        """The robot's own estimate of the external joint torque (N, n) [Nm], or None."""
        return self.channels.get("tau_ext")

    @property
    def wrench(self) -> Array | None:
        """External wrench at the tip (N, 6) [N, N, N, Nm, Nm, Nm], base axes, or None."""
        return self.channels.get("wrench")

    @property
    def n_joints(self) -> int | None:
        """Number of joints that the channels speak of; None where they hold wrenches only."""
        for name, values in self.channels.items():
            if (n := joints_of(name, values.shape[1])) is not None:
                return n
        return None

    @cached_property
    def quality(self) -> Quality:
        """Steps, gaps, repeated, backward and non-finite rows, counted."""
        return Quality.of(self.t, self.channels)

    @property
    def rate_hz(self) -> float:
        """Sampling rate from the median positive step [Hz]; nan where no step is positive."""
        return 1.0 / self.quality.median_step_s

    @property
    def duration_s(self) -> float:
        """Span of the finite time stamps [s]."""
        finite = self.t[np.isfinite(self.t)]
        return float(finite.max() - finite.min()) if finite.size else 0.0

    def between(self, start_s: float, end_s: float) -> Recording:
        """Rows with start_s <= t < end_s [s]; labels are cut to that interval, stamps are not shifted.

        Raises:
            RecordingError: no row lies in between.
        """
        rows = (self.t >= start_s) & (self.t < end_s)
        if not rows.any():
            span = (
                f"{np.nanmin(self.t):g} to {np.nanmax(self.t):g} s" if np.isfinite(self.t).any() else "no finite time"
            )
            raise RecordingError(
                f"no rows from {start_s:g} to {end_s:g} s: the recording holds {span}", path=self.source or None
            )
        labels = tuple(
            replace(label, start_s=max(label.start_s, start_s), end_s=min(label.end_s, end_s))
            for label in self.labels
            if label.start_s < end_s and label.end_s >= start_s
        )
        channels = {name: values[rows] for name, values in self.channels.items()}
        return replace(self, t=self.t[rows], channels=channels, labels=labels)

    def with_channels(self, **arrays: ArrayLike | None) -> Recording:
        """The same recording with channels added or replaced; None removes one.

        Args:
            arrays: canonical name -> values (N, k).
        """
        channels: dict[str, Any] = {**self.channels, **arrays}
        return replace(self, channels={name: values for name, values in channels.items() if values is not None})

    @classmethod
    def read(cls, path: str | Path, *, mapping: str | Path | Mapping[str, Any] | None = None) -> Recording:
        """Read a recording; what the file is, is found by looking into it.

        Args:
            path: CSV (also `;`, tab or blanks between the cells, also gzipped), Parquet, NPZ or JSON.
            mapping: how its columns become channels, where they have other names: a TOML file, the name of a layout
                that comes with the package, or the same
                as a dict.

        Raises:
            RecordingError: the file is missing, torn, not a recording, or its columns cannot be understood.
        """
        from tactful.recordings._read import read

        return read(path, mapping)

    def save(self, path: str | Path) -> None:
        """Write to `.csv`, `.parquet` or `.npz` under canonical names, all at once or not at all.

        Every value reads back bit for bit. Labels and notes go into the file, for CSV beside it in
        `<name>.labels.json`.

        Raises:
            RecordingError: another suffix, or the place cannot be written.
        """
        from tactful.recordings._save import save

        save(self, path)


def _read_only(values: Any, name: str, path: str | None) -> Array:
    try:
        array = np.ascontiguousarray(values, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise RecordingError(f"{name} is not an array of numbers: {error}", path=path, channel=name) from None
    if array is values or array.base is not None or array.flags.writeable:
        array = array.view()
    array.flags.writeable = False
    return array
