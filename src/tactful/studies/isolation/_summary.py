"""From trials to figures: rates with their intervals, errors with their quantiles."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tactful import __version__
from tactful.evaluation import Share
from tactful.isolation import IsolationConfig
from tactful.robots import Robot
from tactful.studies.isolation import _motion, _trials
from tactful.studies.isolation._run import Columns, Results

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Figures = dict[str, Any]

METHODS = {
    "last joint over threshold": "threshold",
    "least squares per link": "least_squares",
    "evidence": "link",
}
SINGULAR_BINS = ((0.0, 0.01), (0.01, 0.03), (0.03, 0.1), (0.1, np.inf))
ESTIMATORS = ("pseudo-inverse", "truncated", "damped", "prior")
_CONFIDENCE = (0.0, 0.5, 0.6, 0.7, 0.8, 0.9, 0.95, 0.99, 1.0)


def summarise(robot: Robot, results: Results, samples: int, seed: int) -> Figures:
    """Return all figures of the study as plain numbers, lists and dicts."""
    links = results["links", ""]
    usual = _where(links, links["noise_nm"] == _trials.NOISE_NM)
    summary: Figures = {
        "study": "isolation",
        "origin": "simulation: every rate here is one of simulated contacts",
        "interval": "95 %, Wilson",
        "version": __version__,
        "robot": robot.name,
        "samples": samples,
        "seed": seed,
        "noise_nm": _trials.NOISE_NM,
        "isolation": IsolationConfig().model_dump(mode="json"),
        "links": _methods(links),
        "by_link": [_one_link(robot, usual, link) for link in np.unique(usual["true"]).astype(int)],
        "region": _share(usual["region_right"]),
        "confusion": _confusion(robot, usual),
        "claims": _claims(usual),
        "calibration": _calibration(usual),
        "distal": _errors(_where(usual, usual["true"] >= 4)),
        "departures": {case: _departure(results["departures", case]) for case in _trials.DEPARTURES},
        "known": [_known(robot, int(case), columns) for (kind, case), columns in results.items() if kind == "known"],
        "pairs": _pairs(robot, results, usual),
        "singular": _singular(results),
        "motion": _motions(results["motion", ""]),
    }
    return summary | {"targets": _targets(summary, usual)}


def _where(columns: Columns, mask: Mask) -> Columns:
    return {name: values[mask] for name, values in columns.items()}


def _share(hits: Array | Mask) -> Figures:
    return Share(int(np.sum(hits != 0)), len(hits)).to_dict()


def _quantiles(values: Array) -> Figures:
    if not len(values):
        return {"median": None, "p90": None}
    return {"median": float(np.median(values)), "p90": float(np.quantile(values, 0.9))}


def _right(columns: Columns, answer: str = "link") -> Figures:
    off = np.abs(columns[answer] - columns["true"])
    return {"exact": _share(off == 0), "within_one": _share(off <= 1)}


def _methods(columns: Columns) -> list[Figures]:
    rows = []
    for noise in _trials.NOISES_NM:
        at = _where(columns, columns["noise_nm"] == noise)
        rows.append({"noise_nm": noise} | {name: _right(at, answer) for name, answer in METHODS.items()})
    return rows


def _errors(columns: Columns) -> Figures:
    named = columns["point_named"] != 0
    return {
        "point_m": _quantiles(columns["point_error_m"]),
        "within_10_cm": _share(columns["point_error_m"] < 0.1),
        "named": _share(named),
        "named_point_m": _quantiles(columns["point_error_m"][named]),
        "force": _quantiles(columns["force_error"]),
        "magnitude": _quantiles(columns["magnitude_error"]),
        "magnitude_inside": _share(columns["magnitude_inside"]),
    }


def _one_link(robot: Robot, columns: Columns, link: int) -> Figures:
    at = _where(columns, columns["true"] == link)
    return {"link": robot.link_names[link]} | _right(at) | _errors(at)


def _confusion(robot: Robot, columns: Columns) -> list[list[int]]:
    counts = np.zeros((robot.n, robot.n), dtype=int)
    np.add.at(counts, (columns["true"].astype(int), columns["link"].astype(int)), 1)
    return counts.tolist()


def _claims(columns: Columns) -> Figures:
    claimed = columns["confidence"] > IsolationConfig().sure
    right = columns["link"] == columns["true"]
    return {"above": IsolationConfig().sure, "made": _share(claimed), "right": _share(right[claimed])}


def _calibration(columns: Columns) -> list[Figures]:
    right, bins = columns["link"] == columns["true"], []
    for low, high in pairwise(_CONFIDENCE):
        inside = (columns["confidence"] > low) & (columns["confidence"] <= high)
        if inside.any():
            mean = float(columns["confidence"][inside].mean())
            bins.append({"above": low, "up_to": high, "mean": mean, "right": _share(right[inside])})
    return bins


def _departure(columns: Columns) -> Figures:
    beyond = _where(columns, columns["true"] >= 3)
    return {
        "links_4_on": _right(beyond),
        "claims": _claims(columns),
        "misfit": _share(columns["misfit"]),
    } | _errors(_where(columns, columns["true"] >= 4))


def _known(robot: Robot, link: int, columns: Columns) -> Figures:
    return {"link": robot.link_names[link]} | _right(columns) | {"unaware": _right(columns, "unaware")}


def _pairs(robot: Robot, results: Results, single: Columns) -> Figures:
    figures: Figures = {"false": {"misfit": _share(single["misfit"]), "odds": _share(single["odds"])}}
    for case, key in ((_trials.AT_TIP, "nearer"), (_trials.ON_ANY, "farther")):
        columns = results["pairs", case]
        figures[case] = {"misfit": _share(columns["misfit"]), "odds": _share(columns["odds"])} | {
            f"{key} on {robot.link_names[link]}": {
                "misfit": _share(columns["misfit"][columns[key] == link]),
                "odds": _share(columns["odds"][columns[key] == link]),
            }
            for link in np.unique(columns[key]).astype(int)
        }
    return figures


def _singular(results: Results) -> list[Figures]:
    parts = [columns for (kind, _), columns in results.items() if kind == "singular"]
    columns = {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
    rows = []
    for low, high in SINGULAR_BINS:
        at = _where(columns, (columns["sigma_min"] >= low) & (columns["sigma_min"] < high))
        count = len(at["sigma_min"])
        inside = Share(int(at["inside"].sum()), 3 * count).to_dict()
        row: Figures = {"sigma_min": [low, None if np.isinf(high) else high], "poses": count, "inside": inside}
        rows.append(row | {name: _quantiles(at[name]) for name in ESTIMATORS})
    return rows


def _motions(columns: Columns) -> list[Figures]:
    rows = []
    last = len(_motion.AFTER_S) - 1
    for bandwidth_hz in _motion.BANDWIDTHS_HZ:
        at = _where(columns, columns["bandwidth_hz"] == bandwidth_hz)
        over_time = [
            {"after_s": round(float(after), 6), "right": _share(at[f"link_{i}"] == at["true"])}
            for i, after in enumerate(_motion.AFTER_S)
        ]
        right = at[f"link_{last}"] == at["true"]
        rows.append(
            {
                "bandwidth_hz": bandwidth_hz,
                "over_time": over_time,
                "settled_s": _quantiles(at["settled_s"]),
                "settled_s_when_right": _quantiles(at["settled_s"][right]),
                "settled_within_30_ms": _share(at["settled_s"] <= 0.0301),
            }
        )
    return rows


def _targets(summary: Figures, usual: Columns) -> list[Figures]:
    """Hold what is reached against what is wanted; links are counted from one."""
    beyond = _right(_where(usual, usual["true"] >= 3))
    distal, pairs = summary["distal"], summary["pairs"]
    fifth = next((row for i, row in enumerate(summary["known"]) if i == 4), None)
    slow = summary["motion"][0]
    rows: list[tuple[str, float, float | None, bool]] = [
        ("link exact, links 4 on", 0.85, beyond["exact"]["value"], True),
        ("link within one, links 4 on", 0.97, beyond["within_one"]["value"], True),
        ("region", 0.90, summary["region"]["value"], True),
        ("claims with P > 0.9 right", 0.97, summary["claims"]["right"]["value"], True),
        ("point, links 5 on, median [m]", 0.012, distal["point_m"]["median"], False),
        ("point, links 5 on, within 10 cm", 0.90, distal["within_10_cm"]["value"], True),
        ("force, links 5 on, median relative error of the vector", 0.05, distal["force"]["median"], False),
        ("second contact on link 5, first known, exact", 0.70, fifth["exact"]["value"] if fifth else None, True),
        ("pairs noticed, one at the tip", 0.85, pairs[_trials.AT_TIP]["odds"]["value"], True),
        ("pairs noticed where there is one contact", 0.02, pairs["false"]["odds"]["value"], False),
        ("link settled after the onset, median [s]", 0.03, slow["settled_s"]["median"], False),
    ]
    return [
        {
            "what": what,
            "target": f"{'at least' if at_least else 'at most'} {target:g}",
            "reached": value,
            "met": value is not None and (value >= target if at_least else value <= target),
        }
        for what, target, value, at_least in rows
    ]
