"""From trials to figures."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from tactful import __version__
from tactful.evaluation import Share
from tactful.studies.teaching._trials import TRAJECTORIES, Trial

Figures = dict[str, Any]


def summarise(trials: dict[str, list[Trial]], seed: int, classifier: str) -> Figures:
    """Return the figures of a study.

    Args:
        trials: by preset of the sensors.
        seed: what they were drawn from.
        classifier: what told the contacts' kinds.
    """
    return {
        "study": "teaching",
        "version": __version__,
        "seed": seed,
        "classifier": classifier,
        "presets": {sensors: _of(rows) for sensors, rows in trials.items()},
        "trials": {sensors: [row.to_dict() for row in rows] for sensors, rows in trials.items()},
    }


def _of(rows: Sequence[Trial]) -> Figures:
    helped = [row for row in rows if row.cooperation is not None]
    merged = [row for row in helped if row.problem is None]
    return {
        "all": _rates(rows),
        "by_trajectory": {name: _rates([row for row in rows if row.trajectory == name]) for name in TRAJECTORIES},
        "by_operator": {
            name: _rates([row for row in rows if row.operator == name])
            for name in sorted({row.operator for row in rows})
        },
        "after_failure": _share([row for row in rows if not row.before], lambda row: row.after),
        "helped": len(helped),
        "recognised": _share(helped, lambda row: bool(row.cooperation)),
        "merged": _share(helped, lambda row: row.problem is None),
        "after_merging": _share(merged, lambda row: row.after),
        "latency_s": _quantiles([row.latency_s for row in helped]),
        "peak_before_n": _quantiles([row.peak_n[0] for row in merged]),
        "peak_after_n": _quantiles([row.peak_n[1] for row in merged]),
    }


def _rates(rows: Sequence[Trial]) -> Figures:
    return {"before": _share(rows, lambda row: row.before), "after": _share(rows, lambda row: row.after)}


def _share(rows: Sequence[Trial], holds: Callable[[Trial], bool]) -> Figures:
    return Share(sum(holds(row) for row in rows), len(rows)).to_dict()


def _quantiles(values: Sequence[float | None]) -> Figures:
    known = [value for value in values if value is not None]
    if not known:
        return {"median": None, "p90": None}
    return {"median": float(np.median(known)), "p90": float(np.quantile(known, 0.9))}
