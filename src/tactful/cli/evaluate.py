"""The verb that holds a monitor against the truth."""

import json as jsonlib
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

from tactful.cli import _evaluation_tables as tables
from tactful.cli._settings import Mode, load_settings
from tactful.errors import TactfulError

if TYPE_CHECKING:
    from tactful.monitor import MonitorConfig
    from tactful.recordings import Label, Recording
    from tactful.robots import Robot

_CONTACT_EVERY_S = 2.0
"""How dense contacts are injected: more of them are put into further passes over the same recording."""
_STRONG_N = 20


def evaluate(
    path: Annotated[list[Path], Parameter(negative_iterable=())],
    /,
    *,
    robot: str | None = None,
    tip: str | None = None,
    config: Path | None = None,
    mapping: Path | None = None,
    mode: Mode | None = None,
    inject: int = 0,
    seed: int = 0,
    json: Path | None = None,
) -> int:
    """Say how good the monitor is on recordings whose contacts are known.

    The truth is the labels of a recording, or the force over 1 N of its force/torque sensor; a recording that has
    neither is taken as free of contact, and that is said. All intervals are those of 95 %.

    Args:
        path: Recordings with labels, or folders of them.
        robot: The arm: a name from `tactful robots`, or an MJCF or URDF file. Not needed where a wrench was recorded.
        tip: The frame at which the force is estimated: a site or link of the robot.
        config: Settings, a TOML file.
        mapping: What the columns of the recordings mean, a TOML file.
        mode: The detector, `fast` or `paper`, see `tactful monitor`.
        inject: Evaluate on so many impacts and pushes, injected into each recording; it has to be free of contact.
        seed: What the injected contacts are drawn from.
        json: Write all figures, and every contact, to this file.

    Returns:
        0, or 1 if samples had to be skipped.
    """
    from tactful.evaluation import Figures, by_operator, find_recordings, grouped, match_events

    if inject < 0 or seed < 0:
        raise TactfulError(f"--inject is {inject} and --seed is {seed}: both are whole numbers from 0 on")
    files = [file for file in find_recordings(path) if json is None or file.resolve() != json.resolve()]
    settings = load_settings(config, robot=robot, tip=tip, mode=mode)
    arm = settings.robot.load()
    progress = Console(stderr=True)
    runs: list[tables.Run] = []
    passes: list[tables.Run] = []
    by_chance = 0
    columns = (TextColumn("{task.description}"), BarColumn(), TextColumn("{task.percentage:3.0f} %"))
    quiet = not progress.is_terminal
    with Progress(*columns, TimeRemainingColumn(), console=progress, transient=True, disable=quiet) as bar:
        task = bar.add_task("", total=len(files) * max(1, inject))
        for number, file in enumerate(files):
            bar.update(task, description=f"reading {file.name}", completed=number * max(1, inject))
            recording, truth = _read(file, mapping, arm)
            bar.update(task, description=file.name if runs else "loading the kernels; the first time, compiling them")
            runs.append(_run(recording, truth, arm, settings))
            bar.update(task, description=file.name)
            for touched in _touched(recording, arm, inject, (seed, number)):
                passes.append(_run(touched, "injected", arm, settings))
                matches = match_events(runs[-1].timeline, touched.labels).matches
                by_chance += sum(match.event is not None for match in matches)
                bar.advance(task, len(touched.labels))
    outcomes = [run.outcome for run in passes or runs]
    # The rate of false alarms is that of the recordings as they are: further passes see the same seconds again.
    figures, as_recorded = Figures.of(outcomes), Figures.of(run.outcome for run in runs)
    keys: tuple[Callable[[Label], str], ...] = (_kind, _strength, _place(arm)) if inject else (_kind,)
    groups = {name: group for key in keys for name, group in grouped(outcomes, key).items()}
    operators = by_operator(outcomes)
    console = Console(highlight=False)
    tables.print_recordings(runs, console)
    tables.print_figures(figures, as_recorded, groups, console)
    tables.print_confusion(figures, console)
    tables.print_operators(operators, console)
    tables.print_force_errors(runs, console)
    tables.print_rule(console)
    if inject:
        tables.print_injection(figures, len(passes), by_chance, console)
    if json is not None:
        injected = {"seed": seed, "passes": len(passes), "found_by_chance": by_chance, **figures.to_dict()}
        report = {
            "figures": as_recorded.to_dict(),
            "injected": injected if inject else None,
            "groups": {name: group.to_dict() for name, group in groups.items()},
            "operators": {name: group.to_dict() for name, group in operators.items()},
            **_provenance(runs, settings),
        }
        json.write_text(jsonlib.dumps(report, indent=1, allow_nan=False) + "\n", encoding="utf-8")
        progress.print(f"[dim]saved {json}[/dim]", highlight=False)
    return int(any(run.timeline.health.degraded for run in runs))


def _read(file: Path, mapping: Path | None, arm: "Robot | None") -> tuple["Recording", str]:
    """Return a recording with its truth, and where that comes from."""
    from tactful.evaluation import check_labels, labels_from_wrench
    from tactful.recordings import Recording

    recording = Recording.read(file, mapping=mapping)
    if arm is None and recording.q is not None and recording.wrench is None:
        raise TactfulError(
            f"{file}: which arm was recorded? Name it: --robot, one of `tactful robots`, or an MJCF or URDF file"
        )
    if recording.labels:
        check_labels(recording, links=arm.n if arm else None)
        return recording, "labels"
    if "wrench_ft" in recording.channels:
        return replace(recording, labels=labels_from_wrench(recording)), "F/T sensor"
    return recording, "none: free"


def _run(recording: "Recording", truth: str, arm: "Robot | None", settings: "MonitorConfig") -> tables.Run:
    """Monitor a recording and hold the result against its labels."""
    from tactful.evaluation import evaluate as held_against_labels
    from tactful.evaluation import force_error
    from tactful.monitor import Monitor

    measured = truth == "F/T sensor"
    timeline = Monitor(arm, settings.fitted_to(recording.rate_hz)).run(recording, trace=measured)
    outcome = held_against_labels(recording, timeline, link_names=arm.link_names if arm else ())
    error = force_error(recording, timeline, arm) if measured and recording.labels else None
    return tables.Run(truth, outcome, timeline, error)


def _touched(
    recording: "Recording", arm: "Robot | None", contacts: int, seed: tuple[int, int]
) -> Iterator["Recording"]:
    """Yield the recording with contacts injected, a few at a time."""
    import numpy as np

    from tactful.evaluation import inject, random_contacts

    rng = np.random.default_rng(seed)
    at_once = max(1, int((recording.duration_s - 1) / _CONTACT_EVERY_S))
    for begin in range(0, contacts, at_once):
        count = min(at_once, contacts - begin)
        yield inject(recording, arm, random_contacts(recording, arm, rng, count=count, first=begin))


def _kind(label: "Label") -> str:
    return label.kind


def _strength(label: "Label") -> str:
    assert label.peak_force_n is not None
    return f"{label.kind} {'from' if label.peak_force_n >= _STRONG_N else 'below'} {_STRONG_N} N"


def _place(arm: "Robot | None") -> Callable[["Label"], str]:
    def place(label: "Label") -> str:
        where = "the tip" if label.link is None or arm is None else arm.link_names[label.link]
        return f"{label.kind} on {where}"

    return place


def _provenance(runs: list[tables.Run], settings: "MonitorConfig") -> dict[str, Any]:
    from tactful import __version__
    from tactful.evaluation import EARLY_S, LATE_S

    return {
        "recordings": [run.to_dict() for run in runs],
        "rule": {"early_s": EARLY_S, "late_s": LATE_S},
        "config": settings.model_dump(mode="json"),
        "version": __version__,
    }
