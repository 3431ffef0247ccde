"""The study as a whole: settings, trials, summary, tables and pictures in a folder."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from multiprocessing import get_context
from pathlib import Path

from tactful.errors import TactfulError
from tactful.monitor import MonitorConfig
from tactful.simulation._spec import SensorPreset
from tactful.studies.teaching._figures import pictures
from tactful.studies.teaching._settings import calibrated
from tactful.studies.teaching._summary import Figures, summarise
from tactful.studies.teaching._tables import tables
from tactful.studies.teaching._trials import Trial, draw_trials, trial

_NAMED = ("learned", "rules")


def teaching_study(
    out: Path,
    *,
    seeds: int = 60,
    seed: int = 0,
    jobs: int = 1,
    presets: Sequence[SensorPreset] = ("clean", "panda"),
    classifier: str = "learned",
    progress: Callable[[float], None] = lambda share: None,
) -> Figures:
    """Measure how often the peg is inserted before and after one correction by hand; the seed decides the result.

    Writes `summary.json`, `tables.md`, `rates.svg`, `lessons.svg` and the settings of the monitors into `out`.

    Args:
        out: folder, made if it is missing.
        seeds: executions that are tried with each preset.
        seed: what everything is drawn from.
        jobs: number of processes.
        presets: of the sensors.
        classifier: what tells the contacts' kinds: `learned`, `rules`, or a model of `tactful train`.
        progress: is told the share that is done.

    Returns:
        What is in `summary.json`.

    Raises:
        TactfulError: if a number is out of range, a file is missing, or the extras `mujoco`, `plot` or `teach` are.
    """
    for name, value, least in (("seeds", seeds, 1), ("jobs", jobs, 1), ("seed", seed, 0)):
        if value < least:
            raise TactfulError(f"{name} is {value}: it has to be at least {least}")
    if classifier not in _NAMED and not Path(classifier).is_file():
        raise TactfulError(f"classifier {classifier!r}: is neither {' nor '.join(_NAMED)} nor a model's file")
    out.mkdir(parents=True, exist_ok=True)
    settings = {sensors: _settings(sensors, seed, classifier, out) for sensors in presets}
    work = [(sensors, spec) for sensors in presets for spec in draw_trials(seeds, seed, sensors)]
    rows: dict[int, Trial] = {}
    if jobs == 1:
        for k, (sensors, spec) in enumerate(work):
            rows[k] = trial(spec, settings[sensors])
            progress(len(rows) / len(work))
    else:
        with ProcessPoolExecutor(jobs, mp_context=get_context("spawn")) as pool:
            waiting = {pool.submit(trial, spec, settings[sensors]): k for k, (sensors, spec) in enumerate(work)}
            for future in as_completed(waiting):
                rows[waiting[future]] = future.result()
                progress(len(rows) / len(work))
    trials: dict[str, list[Trial]] = {sensors: [] for sensors in presets}
    for k, (sensors, _) in enumerate(work):
        trials[sensors].append(rows[k])
    summary = summarise(trials, seed, Path(classifier).name)
    (out / "summary.json").write_text(json.dumps(summary, indent=1, allow_nan=False) + "\n", encoding="utf-8")
    (out / "tables.md").write_text(tables(summary), encoding="utf-8")
    pictures(summary, trials, out)
    return summary


def _settings(sensors: SensorPreset, seed: int, classifier: str, out: Path) -> MonitorConfig:
    """Return the settings that an earlier run of the study has left in the folder, or new ones."""
    import tomli_w

    file = out / f"monitor-{sensors}.toml"
    if not file.is_file():
        found = calibrated(sensors, seed).model_dump(mode="json", exclude_defaults=True, exclude_none=True)
        file.write_text(tomli_w.dumps(found), encoding="utf-8")
    name = classifier if classifier in _NAMED else str(Path(classifier).resolve())
    return MonitorConfig.load(file).model_copy(update={"classifier": name})
