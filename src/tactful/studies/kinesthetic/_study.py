"""The study as a whole: episodes, monitors, figures, tables and a report in a folder."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

from tactful._plotting import matplotlib
from tactful.errors import TactfulError
from tactful.monitor import MonitorConfig
from tactful.studies._parallel import connected
from tactful.studies.kinesthetic._episodes import make_episodes
from tactful.studies.kinesthetic._figures import example, latencies_of, pictures
from tactful.studies.kinesthetic._monitors import paper_monitor
from tactful.studies.kinesthetic._plan import EPISODES, plan
from tactful.studies.kinesthetic._report import report
from tactful.studies.kinesthetic._store import Store
from tactful.studies.kinesthetic._summary import Laboratory, Summary, progress_by, summarise
from tactful.studies.kinesthetic._tables import BLOCKS, markdown
from tactful.studies.kinesthetic._watch import outcome_of

_SIMULATED = 0.6
"""Share of the time that simulation takes."""


def kinesthetic_study(
    out: Path,
    *,
    episodes: int = EPISODES,
    seed: int = 0,
    jobs: int = 1,
    scheduler: str | None = None,
    progress: Callable[[float], None] = lambda share: None,
) -> Summary:
    """Repeat the experiment of the kinesthetic paper in simulation, and measure what does better.

    Writes `summary.json`, `tables.md`, `report.html` and its figures into `out`. What it made on the way stays in
    `out` (`episodes`, `monitors`, `rows`), so that a call that was interrupted is gone on with by the next one.

    Source: J. Salt Ducaju et al. 2022, doi:10.1109/RO-MAN53752.2022.9900800.

    Args:
        out: folder, made if it is missing; with a scheduler its workers have to see it, too.
        episodes: how many the evaluation has; the other sets follow.
        seed: what everything is drawn from.
        jobs: number of processes, where there is no scheduler.
        scheduler: address of a Dask scheduler whose workers do the work, as `tcp://localhost:8786`.
        progress: is told the share that is done.

    Returns:
        What is in `summary.json`.

    Raises:
        TactfulError: if a number is out of range, the folder cannot be written, no scheduler answers, or an extra is
            not installed.
    """
    if jobs < 1:
        raise TactfulError(f"jobs is {jobs}: it has to be at least 1")
    matplotlib()
    sets = plan(episodes, seed)
    out = out.absolute()
    with connected(scheduler) as client:
        made, impossible = make_episodes(
            sets,
            out / "episodes",
            jobs=jobs,
            client=client,
            progress=lambda share: progress(_SIMULATED * share),
        )
        runs = 12 * len(made["evaluation"]) + sum(3 * len(entries) for entries in made.values())
        store = Store(out / "rows", jobs, client, progress_by(runs, _SIMULATED, progress))
        lab = Laboratory(made, out / "episodes", out, store)
        summary = summarise(lab, episodes, seed, impossible)
        _write(lab, summary)
    progress(1.0)
    return summary


def _write(lab: Laboratory, summary: Summary) -> None:
    out = lab.out
    (out / "summary.json").write_text(json.dumps(summary, indent=1, allow_nan=False) + "\n", encoding="utf-8")
    (out / "tables.md").write_text(markdown(summary), encoding="utf-8")
    tuned = summary["tuned"]
    paper = paper_monitor(tuned["threshold_n"], gamma=tuned["gamma"]["floored"])
    said = {
        "paper": lab.say("paper", [paper], "evaluation"),
        "best": lab.say("best", lab.best("", location=True), "evaluation"),
    }
    assert set(said) <= set(BLOCKS)
    files = pictures(summary, {name: latencies_of(rows) for name, rows in said.items()}, out)
    shown = _typical(lab, paper)
    if shown is not None:
        files.append(example(shown, paper, out / "example.png"))
    (out / "report.html").write_text(report(summary, {file.stem: file for file in files}), encoding="utf-8")


def _typical(lab: Laboratory, paper: MonitorConfig) -> Path | None:
    """Return the first episode with a collision and then a cooperation that the paper's monitor tells rightly."""
    for entry, row in zip(lab.made["evaluation"], lab.say("paper", [paper], "evaluation"), strict=True):
        matches = outcome_of(row).matches
        kinds = [match.label.kind for match in matches]
        if kinds == ["collision", "cooperation"] and all(match.kind_right for match in matches):
            return lab.folder / entry.file
    return None
