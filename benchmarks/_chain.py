"""The whole chain in batch and sample by sample, and the same chain written with its peers."""

from __future__ import annotations

import copy
from collections.abc import Callable
from typing import Any

import numpy as np

from benchmarks._motion import TOUCH_S, swing
from benchmarks._parts import parts
from benchmarks._peers import MujocoPeer, Peer, PinocchioPeer
from benchmarks._timing import shortest_s
from tactful import Monitor, MonitorConfig, Recording, Robot, TactfulError

PEERS: dict[str, type[Peer]] = {"pinocchio": PinocchioPeer, "mujoco": MujocoPeer}
_READY = 2000
"""Rows after which a contact can be detected."""
_BATCH_ROWS, _STREAM_ROWS, _PEER_ROWS = 3000, 1000, 100
_TOLERANCE = 1e-6


def measure_chain(robot: Robot, rounds: int) -> dict[str, Any]:
    """Return times a sample of both modes [us] and the ratios of mode "paper" to the peers; None without a peer.

    Raises:
        TactfulError: if a peer finds another residual, wrench, level or contact than the monitor.
    """
    config = MonitorConfig(mode="paper")
    recording = swing(robot, TOUCH_S[1] + 2.0, np.random.default_rng(0))
    ready, fast = Monitor(robot, config), Monitor(robot, MonitorConfig(mode="fast"))
    for monitor in (ready, fast):
        monitor.run(_rows(recording, 0, _READY))
    batch, stream = (_rows(recording, _READY, _READY + rows) for rows in (_BATCH_ROWS, _STREAM_ROWS))
    jobs: dict[str, Callable[[], Callable[[], object]]] = {
        "batch": lambda: _batch(copy.copy(ready), batch),
        "stream": lambda: _warm_stream(copy.copy(ready), stream),
        "fast_batch": lambda: _batch(copy.copy(fast), batch),
        "fast_stream": lambda: _warm_stream(copy.copy(fast), stream),
    }
    samples = {job: _STREAM_ROWS if job.endswith("stream") else _BATCH_ROWS for job in jobs}
    for name, kind in PEERS.items():
        try:
            peer = kind(robot, config)
        except ImportError:
            continue
        compare(
            name, peer, Monitor(robot, config), _rows(recording, round(TOUCH_S[0] * 1e3) - _READY, len(recording.t))
        )
        for job, update in ((name, peer.update), (f"{name}_estimate", peer.estimate)):
            jobs[job] = _again(update, _rows(recording, 0, _PEER_ROWS))
            samples[job] = _PEER_ROWS
    pieces = parts(copy.copy(ready), batch)
    jobs |= pieces
    samples |= dict.fromkeys(pieces, _BATCH_ROWS)
    for prepare in jobs.values():
        prepare()()
    us = {job: 1e6 * seconds / samples[job] for job, seconds in shortest_s(jobs, rounds).items()}
    result: dict[str, Any] = {"chain_batch_us": us["batch"], "chain_stream_us": us["stream"]}
    result |= {"fast_batch_us": us["fast_batch"], "fast_stream_us": us["fast_stream"]}
    for name in PEERS:
        there = name in us
        result |= {
            f"{name}_us": us.get(name),
            f"{name}_estimate_us": us.get(f"{name}_estimate"),
            f"ratio_{name}_batch": us[name] / us["batch"] if there else None,
            f"ratio_{name}_stream": us[name] / us["stream"] if there else None,
            f"ratio_{name}_estimate_batch": us[f"{name}_estimate"] / us["batch"] if there else None,
            f"ratio_{name}_estimate_stream": us[f"{name}_estimate"] / us["stream"] if there else None,
        }
    place, momentum, observer, jacobian, wrench, dft = (us[name] for name in pieces)
    named = {"place": place, "momentum_terms": momentum, "observer": observer - place - momentum}
    named |= {"jacobian": jacobian, "wrench": wrench, "sliding_dft": dft}
    return result | {"parts_us": named | {"rest": us["batch"] - sum(named.values())}}


def _rows(recording: Recording, start: int, stop: int) -> Recording:
    channels = {name: values[start:stop] for name, values in recording.channels.items()}
    return Recording(t=recording.t[start:stop], channels=channels, source=recording.source, format=recording.format)


def _batch(monitor: Monitor, recording: Recording) -> Callable[[], object]:
    return lambda: monitor.run(recording)


def _warm_stream(monitor: Monitor, recording: Recording) -> Callable[[], object]:
    """Take the first sample already: with it a monitor finds its compiled kernel."""
    monitor.update(float(recording.t[0]), **{name: values[0] for name, values in recording.channels.items()})
    return _stream(monitor.update, recording, 1e-3)


def _stream(update: Callable[..., object], recording: Recording, later_s: float = 0.0) -> Callable[[], object]:
    t = (recording.t + later_s).tolist()
    q, dq, tau = (recording.channels[name] for name in ("q", "dq", "tau"))

    def loop() -> None:
        for k in range(len(t)):
            update(t[k], q[k], dq[k], tau[k])

    return loop


def _again(update: Callable[..., object], recording: Recording) -> Callable[[], Callable[[], object]]:
    """Return what prepares the same samples, a little later each time."""
    later_s = 1000.0

    def prepare() -> Callable[[], object]:
        nonlocal later_s
        later_s += len(recording.t) * 1e-3
        return _stream(update, recording, later_s)

    return prepare


def compare(name: str, peer: Peer, monitor: Monitor, recording: Recording) -> None:
    """Check that a peer finds in a recording with a contact what the monitor finds.

    Raises:
        TactfulError: if its residual, wrench or level differs, or it detects the contact at another sample.
    """
    trace = monitor.run(recording, trace=True).trace
    q, dq, tau = (recording.channels[channel] for channel in ("q", "dq", "tau"))
    seen = []
    for k, t in enumerate(recording.t.tolist()):
        peer.update(t, q[k], dq[k], tau[k])
        seen.append((peer.r, peer.F, peer.level, peer.contact))
    for values, field in zip(zip(*seen, strict=True), ("tau_ext", "wrench", "level"), strict=False):
        error = float(np.abs(np.array(values) - trace[field]).max())
        if not error < _TOLERANCE:
            raise TactfulError(f"{name} is no peer: its {field} differs by {error:.3g}, allowed is {_TOLERANCE:g}")
    detected, reference = (int(np.argmax(flags)) for flags in ([contact for *_, contact in seen], trace["state"] != 0))
    if not detected or detected != reference:
        raise TactfulError(f"{name} is no peer: it detects contact at sample {detected}, the monitor at {reference}")
