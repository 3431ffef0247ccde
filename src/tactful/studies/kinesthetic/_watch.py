"""One monitor over one episode: what it said, in plain data."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tactful.classification import Evidence
from tactful.evaluation import Outcome, evaluate, match_events
from tactful.monitor import ContactEvent, Monitor, MonitorConfig, Timeline
from tactful.recordings import Label, Recording
from tactful.robots import Robot
from tactful.simulation import EpisodeEntry
from tactful.studies.kinesthetic._onsets import NotedClassifier

Array = NDArray[np.float64]
Row = dict[str, Any]

THRESHOLDS_N = tuple(float(f"{value:.2g}") for value in np.geomspace(0.2, 10.0, 60))
"""Candidates for F_th [N]."""
_FILL_S = 0.5
"""Time that the window of the frequency detector takes to fill [s]."""
_PEAK_S = 0.1
"""Time after a detection over which the largest level is noted [s]."""


@dataclass(frozen=True)
class Watch:
    """A monitor and an episode.

    Attributes:
        file: the recording.
        config: of the monitor.
        located: whether the monitor looks where a contact is, which takes longer than all else.
        turned: whether the axes of the base are turned, by 45 deg about (1, 1, 1).
        spec: what the episode is, as plain data.
    """

    file: Path
    config: MonitorConfig
    located: bool = False
    turned: bool = False
    spec: dict[str, Any] = field(default_factory=dict)

    @classmethod
    def of(
        cls, entry: EpisodeEntry, folder: Path, config: MonitorConfig, *, located: bool = False, turned: bool = False
    ) -> Watch:
        """Return the watch over an episode of a folder."""
        return cls(folder / entry.file, config, located, turned, entry.spec.model_dump(mode="json"))

    @property
    def robot(self) -> Robot:
        """The arm; without a surface it is not looked where a contact is."""
        robot = self.config.robot.load()
        assert robot is not None
        robot = turned(robot) if self.turned else robot
        return robot if self.located else replace(robot, capsules=())


def watch(task: Watch) -> Row:
    """Run the monitor and return its events, what its classifier was asked, and the truth."""
    recording = Recording.read(task.file)
    robot = task.robot
    classifier = NotedClassifier(task.config.load_classifier(), task.config.kinesthetic)
    paper = task.config.mode == "paper"
    timeline = Monitor(robot, task.config, classifier=classifier).run(recording, trace=paper)
    outcome = evaluate(recording, timeline, link_names=robot.link_names)
    events = [_plain(event) for event in timeline]
    if paper:
        for event in events:
            event["peak_level_n"] = _peak_level(timeline, event["detected_s"])
    return {
        "spec": task.spec,
        "labels": [label.to_dict() for label in recording.labels],
        "events": events,
        "asked": classifier.notes if paper else [],
        "end_s": timeline.end_s,
        "monitored_s": outcome.monitored_s,
        "contact_free_s": outcome.contact_free_s,
        "alarm_s": outcome.alarm_s,
    }


def outcome_of(row: Row) -> Outcome:
    """Return the outcome that a row holds."""
    labels = [Label(**label) for label in row["labels"]]
    matching = match_events(map(_event, row["events"]), labels)
    return Outcome(
        source=row["spec"].get("kind", ""),
        matches=matching.matches,
        false_alarms=matching.false_alarms,
        monitored_s=row["monitored_s"],
        contact_free_s=row["contact_free_s"],
        alarm_s=row["alarm_s"],
    )


def levels(task: Watch) -> Row:
    """Return what every threshold of `THRESHOLDS_N` would make of an episode: first contact found when, false alarms.

    The level does not depend on the threshold, so one run serves them all.
    """
    recording = Recording.read(task.file)
    trace = Monitor(task.robot, task.config).run(recording, trace=True).trace
    t, level = trace["t"], trace["level"].max(axis=1)  # (k,)
    free = t >= t[0] + _FILL_S  # (k,)
    for label in recording.labels:
        free &= (t < label.start_s - 0.05) | (t > label.end_s + 0.2 + _FILL_S)
    first = min(recording.labels, key=lambda label: label.start_s, default=None)
    row: Row = {"spec": task.spec, "contact_free_s": float(free.mean() * (t[-1] - t[0])), "alarms": [], "found_s": []}
    for threshold in THRESHOLDS_N:
        over = level > threshold
        row["alarms"].append(_excursions(t[over & free]))
        if first is not None:
            inside = np.flatnonzero(over & (t >= first.start_s - 0.05) & (t <= first.end_s + 0.2))
            row["found_s"].append(float(t[inside[0]] - first.start_s) if len(inside) else None)
    if first is not None:
        row["kind"] = first.kind
    return row


def turned(robot: Robot) -> Robot:
    """Return the same arm in axes of the base that are turned by 45 deg about (1, 1, 1)."""
    from scipy.spatial.transform import Rotation

    R = Rotation.from_rotvec(np.radians(45.0) * np.ones(3) / np.sqrt(3.0)).as_matrix()
    rotation, translation = robot.rotation.copy(), robot.translation.copy()
    rotation[0], translation[0] = R @ rotation[0], R @ translation[0]
    return replace(robot, rotation=rotation, translation=translation, gravity=R @ robot.gravity)


def _excursions(t: Array) -> int:
    """Return how many there are, those within the length of the window being one."""
    return int(len(t) > 0) + int(np.sum(np.diff(t) > _FILL_S))


def _peak_level(timeline: Timeline, detected_s: float) -> float:
    t = timeline.trace["t"]
    after = (t >= detected_s) & (t <= detected_s + _PEAK_S)
    return float(timeline.trace["level"][after].max())


def _plain(event: ContactEvent) -> Row:
    return event.to_dict() | {"location": None}


def _event(plain: Row) -> ContactEvent:
    values: dict[str, Any] = {key: tuple(x) if isinstance(x, list) else x for key, x in plain.items()}
    values.pop("peak_level_n", None)
    values["evidence"] = tuple(Evidence(**each) for each in plain["evidence"])
    return ContactEvent(**values)


def contact_free_hours(rows: Iterable[Row]) -> float:
    """Return how long nothing touched the arm [h]."""
    return float(sum(row["contact_free_s"] for row in rows)) / 3600
