"""A simulated arm's server in a process of its own, which ends with the test."""

from __future__ import annotations

import contextlib
import itertools
import json
import os
import subprocess
import sys
import threading
import time
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
        with contextlib.suppress(BrokenPipeError, ValueError):  # it may have been switched off
            self.process.stdin.write(b"." * count)

    def switch_off(self) -> None:
        """End the server."""
        assert self.process.stdin is not None
        self.process.stdin.close()

    def switch_off_once_recorded(self, path: Path, size: int) -> None:
        """End the server when so many bytes are in a file."""

        def look() -> None:
            while not path.is_file() or path.stat().st_size < size:
                time.sleep(0.01)
            self.switch_off()

        threading.Thread(target=look, daemon=True).start()

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
            served.switch_off()
            bound = threading.Timer(_END_S, process.kill)
            bound.start()
            lines = process.stdout.read().splitlines()
            bound.cancel()
            if lines:
                served.truth = json.loads(lines[-1])
