"""A simulated arm's server in a process of its own, which ends with the test."""

from __future__ import annotations

import contextlib
import itertools
import json
import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from tests.live._scenes import Scene

_END_S = 60.0
_numbers = itertools.count(1)


def address() -> str:
    """Return an address of this machine that nobody else listens at, not even the same tests in another run."""
    pid = os.getpid()
    return f"127.{1 + pid // 250 % 250}.{1 + pid % 250}.{next(_numbers)}"


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

    def get_in_step(self) -> dict[str, Any]:
        """Let a sample come, and return what the server says when it has sent it: from then on, none comes unasked."""
        self.grant()
        assert self.process.stdout is not None
        told: dict[str, Any] = json.loads(self.process.stdout.readline())
        return told


@contextmanager
def serve(module: str, scene: Scene, host: str | None = None) -> Iterator[Served]:
    """Serve an arm until the end of the block, at any address if none is given; its truth is there afterwards."""
    host = host or address()
    words = [sys.executable, "-m", f"tests.live.{module}", host, json.dumps(asdict(scene))]
    root = Path(__file__).parents[2]
    with subprocess.Popen(words, stdin=subprocess.PIPE, stdout=subprocess.PIPE, bufsize=0, cwd=root) as process:
        assert process.stdout is not None
        assert json.loads(process.stdout.readline()) == {"ready": host}
        served = Served(host, process)
        try:
            yield served
        finally:
            try:
                said = process.communicate(timeout=_END_S)[0]
            finally:
                process.kill()  # if it has not ended
            if lines := said.splitlines():
                served.truth = json.loads(lines[-1])
