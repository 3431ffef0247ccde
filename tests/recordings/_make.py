"""Recordings made up for tests: a smooth motion whose velocities belong to its positions."""

from __future__ import annotations

import numpy as np

from tactful.recordings import Label, Recording


def motion(rows: int = 200, joints: int = 3, rate_hz: float = 1000.0) -> Recording:
    """Sines in q, their derivatives in dq, a gravity-like tau, two labels."""
    t = np.arange(rows) / rate_hz
    w = 2.0 + np.arange(joints)
    q = np.sin(t[:, None] * w)  # (N, n)
    dq = w * np.cos(t[:, None] * w)
    tau = 10.0 * np.cos(q)
    labels = (Label("collision", 0.005, 0.009, 2), Label("cooperation", 0.020, 0.040))
    return Recording(t, {"q": q, "dq": dq, "tau": tau}, labels)


def csv_text(recording: Recording, *, time: str = "time", time_factor: float = 1.0) -> str:
    """A comma-separated table as another program would write it."""
    names = [time]
    columns = [recording.t * time_factor]
    for name, values in recording.channels.items():
        names += [f"{name}_{i}" for i in range(values.shape[1])]
        columns += list(values.T)
    rows = [",".join(map(repr, row)) for row in np.column_stack(columns).tolist()]
    return "\n".join([",".join(names), *rows, ""])
