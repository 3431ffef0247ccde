"""A simulated arm's server in a process of its own, which ends with the test."""

from __future__ import annotations

import contextlib
import json
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from tests.live._scenes import Scene


@dataclass
class Served:
    """A served arm."""

    host: str
    process: subprocess.Popen[bytes]
    truth: dict[str, Any] | None = None
    """What really happened, once it has ended."""

    def grant(self, count: int = 1) -> None:
        """Let the next samples come."""
        assert self.process.stdin is not None
        with contextlib.suppress(BrokenPipeError):
            self.process.stdin.write(b"." * count)
            self.process.stdin.flush()

    def get_in_step(self) -> dict[str, Any]:
        """Let a sample come, and return what the server says when it has sent it: from then on, none comes unasked."""
        self.grant()
        assert self.process.stdout is not None
        told: dict[str, Any] = json.loads(self.process.stdout.readline())
        return told


@contextmanager
def serve(module: str, host: str, scene: Scene) -> Iterator[Served]:
    """Serve an arm until the end of the block; its truth is there afterwards."""
    words = [sys.executable, "-m", f"tests.live.{module}", host, json.dumps(asdict(scene))]
    root = Path(__file__).parents[2]
    with subprocess.Popen(words, stdin=subprocess.PIPE, stdout=subprocess.PIPE, cwd=root) as process:
        assert process.stdout is not None
        assert process.stdin is not None
        assert json.loads(process.stdout.readline()) == {"ready": host}
        served = Served(host, process)
        try:
            yield served
        finally:
            with contextlib.suppress(BrokenPipeError):
                process.stdin.close()
            lines = process.stdout.read().splitlines()
            if lines:
                served.truth = json.loads(lines[-1])
