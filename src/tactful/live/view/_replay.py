"""A recording in the page."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from tactful.live._source import SourceError
from tactful.live.view._messages import Past, Setup, thin
from tactful.live.view._view import View, level_thresholds
from tactful.monitor import Monitor, MonitorConfig, Timeline
from tactful.recordings import Recording


def replay(view: View, path: Path, config: MonitorConfig, mapping: Path | None = None) -> Timeline:
    """Monitor a recording, show it, and return what was found.

    Raises:
        RecordingError: if it cannot be read.
        TactfulError: if it does not fit the arm.
    """
    recording = Recording.read(path, mapping=mapping)
    if recording.wrench is None and config.robot.model is None:
        raise SourceError(f"replay:{path}", "which arm was recorded? Name it: --robot, or robot.model in the settings")
    monitor = Monitor(config=config.fitted_to(recording.rate_hz))
    timeline = monitor.run(recording, trace=True)
    rows = timeline.trace
    good = np.flatnonzero(np.isfinite(rows["t"]))
    trace, index = thin(rows[good], level_thresholds(monitor.config))
    q = recording.q
    view.show(
        Setup(
            source=f"replay:{path.name}",
            robot=monitor.robot,
            model=config.robot.model,
            config=monitor.config,
            commanded=False,
            workshop=False,
            recorded=True,
        ),
        Past(trace=trace, q=None if q is None or monitor.robot is None else q[good][index], events=timeline.events),
    )
    return timeline
