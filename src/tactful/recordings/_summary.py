"""What is in a recording, what can be done with it, and where it may mislead."""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import asdict, dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from tactful.recordings._channels import CHANNELS
from tactful.recordings._label import Label
from tactful.recordings._quality import Quality
from tactful.recordings._recording import Recording
from tactful.recordings._units import largest, position_slope

WINDOW_S = 0.5
"""Length of the window that the band is stated for [s]."""

Array = NDArray[np.float64]


@dataclass(frozen=True)
class ChannelSummary:
    """One channel: its name, title, number of columns, units, range of its finite values and count of the others."""

    name: str
    title: str
    columns: int
    units: tuple[str, ...]
    smallest: float
    largest: float
    nonfinite: int


@dataclass(frozen=True)
class Ability:
    """One step of monitoring: whether the recording has what it takes, and by which way or what is missing."""

    step: Literal["estimation", "detection", "isolation", "classification", "reference"]
    possible: bool
    how: str


@dataclass(frozen=True)
class Summary:
    """All of it.

    Attributes:
        source: the file.
        format: how it is stored.
        rows: number of rows.
        duration_s: span of time [s].
        rate_hz: from the median step [Hz].
        joints: number of joints, None where only wrenches are known.
        channels: what is recorded.
        quality: what is irregular.
        window_s: length of a detection window [s] that `band_hz` is stated for.
        band_hz: lowest and highest frequency [Hz] that the rate carries in such a window of N = rate x window samples:
            from one period in it, rate / N, to Nyquist's rate / 2.
        abilities: what can be monitored, and how.
        labels: the marked intervals.
        traps: what may mislead.
        notes: what was converted, assumed or ignored on reading.
    """

    source: str
    format: str
    rows: int
    duration_s: float
    rate_hz: float
    joints: int | None
    channels: tuple[ChannelSummary, ...]
    quality: Quality
    window_s: float
    band_hz: tuple[float, float]
    abilities: tuple[Ability, ...]
    labels: tuple[Label, ...]
    traps: tuple[str, ...]
    notes: tuple[str, ...]

    @property
    def label_counts(self) -> dict[str, int]:
        """Number of labels of each kind."""
        return dict(Counter(label.kind for label in self.labels))

    def to_dict(self) -> dict[str, Any]:
        """JSON-ready data; what is not finite is None."""
        data: dict[str, Any] = _finite(asdict(self))
        return data


def summarize(recording: Recording) -> Summary:
    """Look through a recording.

    Args:
        recording: any recording, however short or broken.

    Returns:
        What it holds, what can be monitored with it, and what may mislead.
    """
    rate = recording.rate_hz
    window = max(2, round(rate * WINDOW_S)) if math.isfinite(rate) else 2
    return Summary(
        source=recording.source,
        format=recording.format,
        rows=len(recording),
        duration_s=recording.duration_s,
        rate_hz=rate,
        joints=recording.n_joints,
        channels=tuple(_channel(name, values) for name, values in recording.channels.items()),
        quality=recording.quality,
        window_s=window / rate,
        band_hz=(rate / window, rate / 2.0),
        abilities=abilities(set(recording.channels)),
        labels=recording.labels,
        traps=tuple(traps(recording)),
        notes=recording.notes,
    )


def abilities(names: set[str]) -> tuple[Ability, ...]:
    """What can be monitored with these channels, and how."""
    observer = {"q", "dq", "tau"} <= names
    if observer:
        way = "momentum observer on q, dq and tau, with the model of the robot"
    elif {"q", "tau_ext"} <= names:
        way = f"the observer is skipped, tau_ext is taken: there is no {_without(names, 'dq', 'tau')}"
    elif "wrench" in names:
        way = f"skipped, the wrench is the robot's own: there is no {_without(names, 'q', 'dq', 'tau')}"
    elif "tau_ext" in names:
        way = "tau_ext is the robot's own, but without q it gives no force"
    else:
        way = f"there is no {_without(names, 'q', 'dq', 'tau')}, nor tau_ext, nor wrench"
    estimation = observer or bool(names & {"tau_ext", "wrench"})
    forced = "wrench" in names or observer or {"q", "tau_ext"} <= names
    force = "on the external force at the tip" if forced else "needs a wrench, or q to turn tau_ext into one"
    turned = {"q"} <= names and (observer or "tau_ext" in names)
    moving = forced and {"q", "dq"} <= names
    result = [
        Ability("estimation", estimation, way),
        Ability("detection", forced, force),
        Ability(
            "isolation",
            turned,
            "the link, and the force there" if turned else "needs q and an external joint torque",
        ),
        Ability(
            "classification",
            moving,
            "collision or cooperation, from the velocity of the tip"
            if moving
            else f"contacts stay `contact`: there is no {_without(names, 'q', 'dq')} for the velocity of the tip"
            if forced
            else "needs detection",
        ),
    ]
    if "wrench_ft" in names:
        result.append(Ability("reference", True, "wrench_ft, a force/torque sensor to compare with"))
    return tuple(result)


def traps(recording: Recording) -> list[str]:
    """What may mislead, a line each."""
    quality, q, dq, tau = recording.quality, recording.q, recording.dq, recording.tau
    found: list[str] = []

    def share(count: int) -> str:
        return f"{count} rows ({100 * count / quality.rows:.2g} %)"

    if quality.rows < 10:
        found.append(f"{quality.rows} rows are too few to monitor")
    if quality.repeated_rows > 0.001 * quality.rows and quality.repeated_rows > 1:
        found.append(f"{share(quality.repeated_rows)} repeat the row before: the logger ran faster than the data came")
    if quality.jitter_s > 0.1 * quality.median_step_s:
        found.append(
            f"steps vary by {100 * quality.jitter_s / quality.median_step_s:.0f} % of the median: stamps were taken by "
            "the logger, not by the robot"
        )
    if quality.backward_steps:
        found.append(
            f"time runs backward {quality.backward_steps} times: two recordings in one file, or a clock was set"
        )
    if quality.nonfinite_rows:
        found.append(f"{share(quality.nonfinite_rows)} hold a NaN or an infinity: the monitor skips them")
    slope = position_slope(recording.t, q, dq)
    if slope is not None and not 0.8 < slope < 1.25:
        found.append(f"diff(q) is {slope:.3g} times dq dt: the units of q, dq or time disagree")
    reach = largest(q)
    if reach > 2.1 * math.pi:
        found.append(f"q reaches {reach:.3g} rad, more than a turn: degrees?")
    if q is not None and len(q) > 1 and (resolution := _resolution(q)) > 2e-5:
        found.append(f"q is written in steps of {resolution:.1g} rad: too coarse to take its derivative")
    if (excess := _velocity_error(recording)) > 0.1:
        found.append(f"dq is off diff(q)/dt by {100 * excess:.0f} % of its rms over 50 ms: delayed or filtered?")
    if tau is not None and q is not None and 0.0 < largest(tau) < 1.0:
        found.append(f"tau stays within {largest(tau):.2g} Nm: is gravity taken out? Tactful expects it included")
    still = q is not None and len(q) > 10 and _travel(q) < 0.01
    for name in ("tau", "tau_ext", "wrench") if still else ("q", "dq", "tau", "tau_ext", "wrench"):
        values = recording.channels.get(name)
        if values is not None and len(values) > 10 and (stuck := np.flatnonzero((values == values[0]).all(0))).size:
            found.append(f"{', '.join(f'{name}_{i}' for i in stuck)} never changes")
    if still:
        found.append("the arm stands still: friction hides small forces, and nothing tells a bias from a steady push")
    if recording.tau_ext is not None:
        with np.errstate(invalid="ignore", over="ignore"):
            offset = np.median(recording.tau_ext, axis=0)
        if (worst := int(np.argmax(np.abs(np.nan_to_num(offset))))) >= 0 and abs(offset[worst]) > 1.0:
            found.append(
                f"tau_ext_{worst} is {offset[worst]:.2g} Nm in the median: an error of the model, or a steady push"
            )
    return found


def _channel(name: str, values: Array) -> ChannelSummary:
    finite = np.isfinite(values)
    smallest = float(np.min(values, initial=math.inf, where=finite))
    largest = float(np.max(values, initial=-math.inf, where=finite))
    return ChannelSummary(
        name=name,
        title=CHANNELS[name].title,
        columns=values.shape[1],
        units=CHANNELS[name].units,
        smallest=smallest if finite.any() else math.nan,
        largest=largest if finite.any() else math.nan,
        nonfinite=int(values.size - np.count_nonzero(finite)),
    )


def _without(names: set[str], *wanted: str) -> str:
    return ", ".join(name for name in wanted if name not in names)


def _travel(q: Array) -> float:
    """Widest range of any joint [rad]."""
    finite = np.isfinite(q)
    span = np.max(q, axis=0, initial=-math.inf, where=finite) - np.min(q, axis=0, initial=math.inf, where=finite)
    return float(span.max())


def _resolution(q: Array) -> float:
    """Smallest change of any joint that is not none [rad]."""
    with np.errstate(invalid="ignore"):
        step = np.abs(np.diff(q[:50_000], axis=0))
    return float(np.min(step, initial=math.inf, where=step > 0)) if np.any(step > 0) else 0.0


def _velocity_error(recording: Recording) -> float:
    """Error of dq against diff(q)/dt over 50 ms, as a share of the rms of dq; 0 where that cannot be told."""
    t, q, dq, step = recording.t, recording.q, recording.dq, recording.quality.median_step_s
    if q is None or dq is None or not step > 0:
        return 0.0
    stride = max(1, round(0.05 / step))
    blocks = (len(t) - 1) // stride
    if blocks < 20:
        return 0.0
    edges = np.arange(blocks + 1) * stride
    with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
        taken = np.diff(q[edges], axis=0)
        steps = np.diff(t)[: blocks * stride, None]
        mean = 0.5 * (dq[:-1] + dq[1:])[: blocks * stride] * steps
        expected = mean.reshape(blocks, stride, -1).sum(1)
        good = np.isfinite(taken).all(1) & np.isfinite(expected).all(1)
        scale = float(np.sqrt(np.mean(expected[good] ** 2))) if good.any() else 0.0
        error = float(np.sqrt(np.mean((taken - expected)[good] ** 2))) if good.any() else 0.0
    moving = scale > 0.002 and math.isfinite(scale) and math.isfinite(error)
    return error / scale if moving else 0.0


def _finite(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _finite(entry) for key, entry in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(entry) for entry in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
