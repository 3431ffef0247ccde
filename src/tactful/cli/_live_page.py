"""`tactful live --view`: the same run with a page beside it."""

from __future__ import annotations

import json as jsonlib
import signal
import threading
from pathlib import Path
from typing import TYPE_CHECKING

from rich.console import Console

from tactful.cli.live import run_once

if TYPE_CHECKING:
    from tactful.live import Source
    from tactful.live.view import View
    from tactful.monitor import MonitorConfig
    from tactful.reaction import ReactionConfig

_WORKSHOP = {"resume_s": 1.5, "guiding": "translation"}
"""How the arm in simulation differs from the policy `teach` if it is not told otherwise: it goes on by itself after it
has stopped, and keeps its orientation while it is led."""


def run_in_page(
    origin: Source,
    policy: ReactionConfig | None,
    *,
    port: int,
    react: str | None,
    record: Path | None,
    duration_s: float | None,
    speed: float,
    mapping: Path | None,
    json: bool,
    console: Console,
) -> int:
    """Run with a page, in simulation as often as it is reset there, and return the exit code."""
    from tactful.live.sources import Settings
    from tactful.live.sources.sim import SimSource
    from tactful.live.view import View
    from tactful.reaction import NAMED

    scheme, _, address = origin.name.partition(":")
    shown = react if react in NAMED else None
    if scheme == "sim" and policy is None:
        policy, shown = NAMED["teach"].model_copy(update=_WORKSHOP), "teach"
    with View(port) as view:
        console.print(f"the page: [bold]{view.address}[/bold]")
        if scheme == "replay":
            return _replay(view, Path(address.removeprefix("//")), origin.config, mapping, json, console)
        while True:
            if scheme == "sim":
                settings = Settings(config=origin.config, react=True, speed=speed)
                origin = SimSource(origin.name, settings, alone=False)
            code = run_once(
                origin,
                policy,
                record=record,
                duration_s=duration_s,
                json=json,
                console=console,
                view=view,
                shown_policy=shown,
            )
            if not view.finish():
                return code
            record = None  # the file holds the first run


def _replay(view: View, path: Path, settings: MonitorConfig, mapping: Path | None, json: bool, console: Console) -> int:
    """Show a recording until Ctrl-C."""
    from tactful.live.view import replay

    timeline = replay(view, path, settings, mapping)
    for event in timeline:
        if json:
            print(jsonlib.dumps({"source": str(path), **event.to_dict()}, allow_nan=False), flush=True)
    found = len(timeline)
    console.print(f"[dim]{found} contact{'s' * (found != 1)} in {path}: {timeline.health}; Ctrl-C ends the page[/dim]")
    over = threading.Event()
    before = {number: signal.signal(number, lambda *_: over.set()) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        view.wait(over.is_set)
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
    return int(timeline.health.degraded)
