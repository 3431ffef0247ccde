"""Events and timelines by hand."""

from __future__ import annotations

from typing import Any

import numpy as np

from tactful import ContactEvent, Label, MonitorConfig, Recording, Timeline
from tactful.monitor import Health


def event(detected_s: float, **fields: Any) -> ContactEvent:
    """Return an event that was detected at a time and set its onset 20 ms before."""
    known: dict[str, Any] = {
        "id": 0,
        "phase": "ended",
        "kind": "contact",
        "onset_s": detected_s - 0.02,
        "end_s": detected_s + 0.1,
        "link": None,
        "directions": ("x",),
        "force_n": (10.0, 0.0, 0.0),
        "peak_force_n": 10.0,
        "torque_ext_nm": (),
        "velocity_m_s": None,
        "confidence": 0.5,
        "evidence": (),
        "sigma_min": None,
        "damped": False,
    }
    return ContactEvent(detected_s=detected_s, **(known | fields))


def timeline(*events: ContactEvent, end_s: float = 10.0, **config: Any) -> Timeline:
    """Return a timeline from 0 to `end_s`."""
    return Timeline(
        events=events,
        health=Health(samples=1000, nonfinite=0, backward=0, gaps=0, repeated=0),
        config=MonitorConfig(**config),
        robot=None,
        source="made.csv",
        start_s=0.0,
        end_s=end_s,
    )


def recording(*labels: Label, end_s: float = 10.0, rate_hz: float = 100.0) -> Recording:
    """Return a wrench of zeros from 0 to `end_s`, with labels."""
    t = np.arange(round(end_s * rate_hz) + 1) / rate_hz
    return Recording(t=t, channels={"wrench": np.zeros((len(t), 6))}, labels=labels, source="made.csv")
