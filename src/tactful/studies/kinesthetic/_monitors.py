"""The monitors of the study: the paper's, and the fast one, calibrated and trained."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from tactful.calibration import calibrate
from tactful.classification import AdditiveModel, KinestheticConfig
from tactful.detection import ContactConfig
from tactful.learning import Decision, Seen, decisions_of, seen, train
from tactful.monitor import MonitorConfig
from tactful.recordings import Recording
from tactful.simulation import PEG, EpisodeEntry
from tactful.studies._parallel import results
from tactful.studies.kinesthetic._store import code
from tactful.studies.kinesthetic._tune import Rule
from tactful.studies.kinesthetic._watch import Watch

VERBATIM = ContactConfig(
    release_ratio=1.0, hold_s=0.0, release_force_n=None, collision_to_free=False, merge_s=0.0, search_s=0.5
)
"""Algorithm 1 as it is printed."""
_BARE: dict[str, float] = {"secant_s": 0.0, "velocity_s": 0.0, "standstill_m_s": 0.0}


def paper_monitor(
    threshold_n: float = 0.85, *, rule: Rule = "floored", gamma: float | None = None, verbatim: bool = False
) -> MonitorConfig:
    """Return the monitor of the paper.

    Args:
        threshold_n: F_th [N].
        rule: variant of A1 and A2.
        gamma: its threshold, in degrees for "angle"; None takes the default.
        verbatim: whether Algorithms 1 and 2 are taken as printed, without what Tactful adds to them.
    """
    values: dict[str, Any] = dict(_BARE) if verbatim else {}
    if gamma is not None:
        values["gamma_deg" if rule == "angle" else "gamma"] = gamma
    config = MonitorConfig(
        mode="paper",
        classifier="kinesthetic",
        robot=PEG,
        frequency={"threshold_n": threshold_n},
        kinesthetic=KinestheticConfig(rule=rule, **values),
    )
    return config.model_copy(update={"contact": VERBATIM}) if verbatim else config


def calibrated_monitor(entries: Sequence[EpisodeEntry], folder: Path, file: Path) -> MonitorConfig:
    """Return the fast monitor with the rules, calibrated on motion without contact as users do it; kept in a file.

    Raises:
        CalibrationError: if the episodes do not suffice.
    """
    digest = _digest([entry.file for entry in entries])
    if file.is_file() and (config := MonitorConfig.load(file)).provenance.get("study") == digest:
        return config
    found = calibrate(
        [Recording.read(folder / entry.file) for entry in entries], MonitorConfig(robot=PEG, classifier="kinesthetic")
    )
    provenance = {**found.config.provenance, "recordings": len(entries), "study": digest}
    config = found.config.model_copy(update={"provenance": provenance})
    file.parent.mkdir(parents=True, exist_ok=True)
    config.save(file)
    return config


def trained_monitor(
    config: MonitorConfig,
    entries: Sequence[EpisodeEntry],
    folder: Path,
    file: Path,
    *,
    location: bool,
    jobs: int,
    client: Any = None,
) -> MonitorConfig:
    """Return the fast monitor with a classifier that was trained on episodes, which is kept in a file.

    Raises:
        LearningError: if the episodes do not suffice.
    """
    digest = _digest([entry.file for entry in entries], str(location), config.model_dump_json(exclude={"provenance"}))
    if not (file.is_file() and AdditiveModel.load(file).provenance.get("study") == digest):
        tasks = [Watch.of(entry, folder, config, located=location) for entry in entries]
        gathered = dict(results(decide, tasks, jobs=jobs, client=client))
        decisions = [decision for number in sorted(gathered) for decision in gathered[number]]
        about = {"study": digest, "recordings": len(entries)}
        trained = train(decisions, location=location, config=config.learned, provenance=about)
        trained.model.save(file)
    return config.model_copy(update={"classifier": str(file.absolute())})


def decide(task: Watch) -> tuple[Decision[Seen], ...]:
    """Return what a classifier has to decide in an episode."""
    recording = Recording.read(task.file)
    config = task.config
    operator = task.spec["operator"]
    return decisions_of(recording, task.robot, config, seen, operator=operator, wait_s=config.learned.wait_s)


def _digest(names: Sequence[str], *settings: str) -> str:
    return hashlib.sha256("\n".join((code(), *names, *settings)).encode()).hexdigest()[:16]
