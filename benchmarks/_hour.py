"""An hour at 1 kHz from a Parquet file, in a process of its own."""

from __future__ import annotations

import json
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks._motion import swing
from tactful import Monitor, Recording, Robot


def measure_hour(robot: str, duration_s: float, repeats: int, folder: Path) -> dict[str, Any]:
    """Return the time from the start of Python to the last contact [s], its parts, and the most memory [GB].

    The fastest of several processes counts. The file is written once and is in the page cache, so the disk does not
    count; it is written by another process, so what that holds does not count either.
    """
    file = folder.resolve() / f"swing_{robot}_{duration_s:g}s.parquet"
    if not file.exists():
        _call("write", robot, f"{duration_s}", str(file))
    results = []
    for _ in range(repeats):
        begin = time.perf_counter()
        result: dict[str, Any] = json.loads(_call("monitor", robot, str(file)))
        results.append({"hour_s": time.perf_counter() - begin, "hour_file_gb": file.stat().st_size / 1e9, **result})
    return min(results, key=lambda result: float(result["hour_s"]))


def _call(*arguments: str) -> str:
    command = [sys.executable, "-m", "benchmarks._hour", *arguments]
    checkout = Path(__file__).parents[1]
    return subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True, cwd=checkout).stdout


def _write(robot: str, duration_s: str, file: str) -> None:
    swing(Robot.load(robot), float(duration_s), np.random.default_rng(0)).save(file)


def _monitor(robot: str, file: str) -> None:
    begin = time.perf_counter()
    recording = Recording.read(file)
    read = time.perf_counter()
    timeline = Monitor(Robot.load(robot)).run(recording)
    ran = time.perf_counter()
    result = {"hour_read_s": read - begin, "hour_run_s": ran - read, "hour_contacts": len(timeline)}
    print(json.dumps(result | {"hour_peak_gb": _peak_gb()}))


def _peak_gb() -> float | None:
    try:
        import resource
    except ImportError:  # Windows
        return None
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / (1e9 if sys.platform == "darwin" else 1e6 / 1.024)


if __name__ == "__main__":
    verb, *words = sys.argv[1:]
    _write(*words) if verb == "write" else _monitor(*words)
