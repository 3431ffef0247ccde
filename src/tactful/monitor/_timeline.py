"""What a monitor saw in a recording."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tactful.errors import TactfulError
from tactful.monitor._config import MonitorConfig
from tactful.monitor._event import ContactEvent


@dataclass(frozen=True, slots=True, kw_only=True)
class Health:
    """How good the samples were."""

    samples: int
    """All that came."""
    nonfinite: int
    """Skipped, since a value was not a finite number, or beyond 1e9."""
    backward: int
    """Skipped, since time did not advance."""
    gaps: int
    """Jumps in time after which the monitor started anew."""
    repeated: int
    """Taken, though all values were those of the sample before."""

    @property
    def degraded(self) -> bool:
        """Whether anything was skipped or lost."""
        return bool(self.nonfinite or self.backward or self.gaps)

    def __str__(self) -> str:
        """Say what was wrong, in words."""
        parts = [
            f"{self.nonfinite} skipped with a value that is not a number" if self.nonfinite else "",
            f"{self.backward} skipped whose time did not advance" if self.backward else "",
            f"{self.gaps} gap{'s' * (self.gaps != 1)} in time" if self.gaps else "",
            f"{self.repeated} repeated" if self.repeated else "",
        ]
        return f"{self.samples} samples" + "".join(f", {part}" for part in parts if part)


@dataclass(frozen=True, eq=False, kw_only=True)
class Timeline:
    """The contacts in a recording, in the order of their detection.

    Attributes:
        events: each contact as it was known last.
        health: how good the samples were.
        config: the configuration that gave the result.
        robot: name of the robot, None without one.
        source: where the samples came from.
        start_s: time of the first sample [s].
        end_s: time of the last sample [s].
        bias_nm: bias of the external torque that was followed, at the end (n,) [Nm]; see `FastConfig.bias_s`.
        bias_limit_nm: its bound (n,) [Nm].
        trace: one row a sample with the fields t [s], tau_ext (n,) [Nm], wrench (6,) [N, Nm], twist (6,) [m/s, rad/s],
            level (3,) [N] and state (0 free, 1 collision, 2 cooperation, 3 contact); None unless it was asked for.
    """

    events: tuple[ContactEvent, ...]
    health: Health
    config: MonitorConfig
    robot: str | None
    source: str
    start_s: float
    end_s: float
    bias_nm: tuple[float, ...] = ()
    bias_limit_nm: tuple[float, ...] = ()
    trace: Any = None

    def __len__(self) -> int:
        return len(self.events)

    def __iter__(self) -> Iterator[ContactEvent]:
        return iter(self.events)

    def to_json_lines(self) -> str:
        """Return one JSON object a line for every contact."""
        return "".join(event.to_json() + "\n" for event in self.events)

    def save(self, path: str | Path) -> None:
        """Write the contacts to a Parquet file, or to JSON lines by the suffix `.jsonl`; the configuration goes along.

        Raises:
            TactfulError: if the suffix is another one, the file cannot be written, or pyarrow is not installed.
        """
        file = Path(path)
        writer = {".parquet": self._save_parquet, ".jsonl": self._save_json_lines}.get(file.suffix)
        if writer is None:
            raise TactfulError(
                f"{file}: events are saved as .parquet or .jsonl, not {file.suffix or 'without a suffix'}"
            )
        partial = file.with_name(file.name + ".partial")
        try:
            writer(partial)
            partial.replace(file)
        except OSError as error:
            raise TactfulError(f"{file}: cannot be written: {error.strerror or error}") from None
        finally:
            partial.unlink(missing_ok=True)

    def _save_json_lines(self, file: Path) -> None:
        file.write_text(self.to_json_lines(), encoding="utf-8")

    def _save_parquet(self, file: Path) -> None:
        try:
            import pyarrow as pa
            import pyarrow.parquet as pq
        except ImportError:
            raise TactfulError('Parquet needs pyarrow: pip install "tactful[files]", or save to .jsonl') from None
        vector = pa.list_(pa.float64())
        evidence = pa.struct(
            [("rule", pa.string()), ("value", pa.float64()), ("threshold", pa.float64()), ("text", pa.string())]
        )
        location = pa.struct(
            [
                ("link", pa.string()),
                ("confidence", pa.float64()),
                ("ambiguous", pa.bool_()),
                ("region", pa.string()),
                ("region_confidence", pa.float64()),
                ("point_m", vector),
                ("force_n", vector),
                ("magnitude_n", pa.float64()),
                ("magnitude_interval_n", vector),
                ("several", pa.bool_()),
            ]
        )
        schema = pa.schema(
            [
                ("id", pa.int64()),
                ("phase", pa.string()),
                ("kind", pa.string()),
                ("onset_s", pa.float64()),
                ("detected_s", pa.float64()),
                ("end_s", pa.float64()),
                ("link", pa.string()),
                ("location", location),
                ("directions", pa.list_(pa.string())),
                ("force_n", vector),
                ("peak_force_n", pa.float64()),
                ("torque_ext_nm", vector),
                ("velocity_m_s", vector),
                ("confidence", pa.float64()),
                ("reason", pa.string()),
                ("evidence", pa.list_(evidence)),
                ("sigma_min", pa.float64()),
                ("damped", pa.bool_()),
            ],
            metadata={
                "tactful": json.dumps(
                    {"config": self.config.model_dump(mode="json"), "robot": self.robot, "source": self.source}
                )
            },
        )
        pq.write_table(pa.Table.from_pylist([event.to_dict() for event in self.events], schema=schema), file)

    def plot(self, path: str | Path | None = None) -> Any:
        """Draw forces, levels against their threshold, and the states as bands, as Fig. 1 of the kinesthetic paper.

        Args:
            path: where to save the picture; its suffix gives the format.

        Returns:
            the matplotlib figure.

        Raises:
            TactfulError: if the timeline has no trace, the file cannot be written, or matplotlib is not installed.
        """
        from tactful.monitor._plot import draw

        return draw(self, path)
