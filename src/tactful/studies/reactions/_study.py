"""The study as a whole: trials in the order of their seeds, a summary, and its table."""

from __future__ import annotations

import json
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from itertools import product
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tactful.errors import TactfulError
from tactful.studies.reactions._trials import POLICIES, SETTLED_S, Trial, collide

Array = NDArray[np.float64]

_RESAMPLES = 2000


def reactions_study(
    out: Path,
    *,
    samples: int = 40,
    seed: int = 0,
    jobs: int = 1,
    progress: Callable[[float], None] = lambda share: None,
) -> dict[str, Any]:
    """Measure what reactions do to collisions in simulation; the result depends on the seed alone.

    Every collision is met by every reaction. Writes `summary.json` and `tables.md` into `out`.

    Args:
        out: folder, made if it is missing.
        samples: number of collisions.
        seed: what they are drawn from.
        jobs: number of processes.
        progress: is told the share of the trials that is done.

    Returns:
        What is in `summary.json`.

    Raises:
        TactfulError: if a number is out of range, or MuJoCo is not installed.
    """
    for name, value, least in (("samples", samples, 2), ("jobs", jobs, 1), ("seed", seed, 0)):
        if value < least:
            raise TactfulError(f"{name} is {value}: it has to be at least {least}")
    summary = summarise(_run(samples, seed, jobs, progress), samples, seed)
    out.mkdir(parents=True, exist_ok=True)
    (out / "summary.json").write_text(json.dumps(summary, indent=1, allow_nan=False) + "\n", encoding="utf-8")
    (out / "tables.md").write_text(table(summary), encoding="utf-8")
    return summary


def _run(samples: int, seed: int, jobs: int, progress: Callable[[float], None]) -> dict[str, list[Trial]]:
    plan = list(product(range(samples), POLICIES))
    seeds = [(seed, number) for number, _ in plan]
    policies = [policy for _, policy in plan]
    results: list[Trial] = []

    def collect(trials: Any) -> None:
        for trial in trials:
            results.append(trial)
            progress(len(results) / len(plan))

    if jobs == 1:
        collect(map(collide, seeds, policies))
    else:
        with ProcessPoolExecutor(jobs, mp_context=get_context("spawn")) as pool:
            collect(pool.map(collide, seeds, policies))
    return {
        policy: [result for (_, name), result in zip(plan, results, strict=True) if name == policy]
        for policy in POLICIES
    }


def summarise(trials: dict[str, list[Trial]], samples: int, seed: int) -> dict[str, Any]:
    """Return the figures of all reactions, over the collisions that happened without one."""
    columns = {
        policy: {name: np.array([row[name] for row in rows]) for name in rows[0]} for policy, rows in trials.items()
    }
    met = columns["continue"]["touched"] > 0
    rng = np.random.default_rng(seed)
    reactions = {}
    for policy, column in columns.items():
        peak, without = column["peak_n"][met], columns["continue"]["peak_n"][met]
        reactions[policy] = {
            "peak_n": _spread(peak),
            "peak_share": _ratio(peak, without, rng),
            "contact_s": _spread(column["contact_s"][met]),
            "later_n": _spread(column["later_n"][met]),
            "told": int(np.isfinite(column["told"][met]).sum()),
            "told_s": _spread(column["told"][met]),
        }
    return {
        "origin": "simulation",
        "robot": "panda",
        "seed": seed,
        "samples": samples,
        "collisions": int(met.sum()),
        "speed_m_s": _spread(columns["continue"]["speed_m_s"][met]),
        "reactions": reactions,
        "targets": [
            _target(policy, f"{policy}: {what}, share of that without", reactions, read)
            for policy, what, read in (
                ("stop", "peak force, mean", lambda row: row["peak_share"]["mean"]),
                ("stop", "force later, median", lambda row: row["later_n"]["median"]),
                ("retract", "peak force, mean", lambda row: row["peak_share"]["mean"]),
                ("retract", "time in contact, median", lambda row: row["contact_s"]["median"]),
            )
        ],
    }


def _target(policy: str, what: str, reactions: dict[str, Any], read: Callable[[Any], float]) -> dict[str, Any]:
    """Return what a reaction leaves of a figure; less than all of it is wanted."""
    reached = read(reactions[policy]) / read(reactions["continue"])
    return {"what": what, "target": "< 1", "reached": reached, "met": reached < 1}


def _spread(values: Array) -> dict[str, float | None]:
    good = values[np.isfinite(values)]
    if not len(good):
        return {"median": None, "low": None, "high": None}
    low, median, high = np.percentile(good, [5, 50, 95])
    return {"median": float(median), "low": float(low), "high": float(high)}


def _ratio(values: Array, without: Array, rng: np.random.Generator) -> dict[str, float]:
    """Return the mean share of what it is without, with its 95 % interval by the bootstrap over collisions."""
    share = values / without
    means = rng.choice(share, (_RESAMPLES, len(share))).mean(axis=1)
    low, high = np.percentile(means, [2.5, 97.5])
    return {"mean": float(share.mean()), "low": float(low), "high": float(high)}


def table(summary: dict[str, Any]) -> str:
    """Return the summary as Markdown."""
    speed = summary["speed_m_s"]
    text = (
        f"# Reactions to collisions: {summary['robot']}\n\n"
        f"**From simulation**, seed {summary['seed']}: {summary['collisions']} collisions of the tip with a post at "
        f"{speed['median']:.2f} m/s [{speed['low']:.2f}, {speed['high']:.2f}]; place and hardness of the post and the "
        "speed are drawn, all reactions meet the same collisions. Brackets: 5 and 95 % of the collisions; of the share,"
        " the 95 % interval of the mean.\n\n"
        "| reaction | peak force [N] | share of the peak without | time in contact [s] | largest force later than "
        f"{SETTLED_S:g} s after the touch [N] | told after [ms] |\n| --- | --- | --- | --- | --- | --- |\n"
    )
    for policy, row in summary["reactions"].items():
        share = row["peak_share"]
        cells = (
            "none" if policy == "continue" else policy,
            _cell(row["peak_n"], "{:.0f}"),
            f"{share['mean']:.2f} [{share['low']:.2f}, {share['high']:.2f}]",
            _cell(row["contact_s"], "{:.2f}"),
            _cell(row["later_n"], "{:.0f}"),
            _cell(row["told_s"], "{:.0f}", 1e3),
        )
        text += f"| {' | '.join(cells)} |\n"
    return text


def _cell(spread: dict[str, float | None], form: str, factor: float = 1.0) -> str:
    if spread["median"] is None:
        return "-"
    median, low, high = (form.format(factor * (spread[key] or 0.0)) for key in ("median", "low", "high"))
    return f"{median} [{low}, {high}]"
