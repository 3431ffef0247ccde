"""What it takes to import the library and to call the command line."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks._motion import swing
from tactful import Robot, TactfulError

_DURATION_S = 10.0


def measure_start(robot: str, repeats: int, *, first_call: bool) -> dict[str, Any]:
    """Return the shortest of several times of each [s]; the first call ever, which compiles, has one only."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        file = folder / "swing.csv"
        swing(Robot.load(robot), _DURATION_S, np.random.default_rng(0)).save(file)
        first_s = None
        if first_call:
            first_s, told = _call(robot, file, NUMBA_CACHE_DIR=str(folder / "kernels"))
            if "compiled" not in told:
                raise TactfulError("the first call of `tactful monitor` did not say that it compiles")
        _call(robot, file)
        return {
            "import_s": _import_s("import tactful", repeats),
            "import_monitor_s": _import_s("from tactful import Monitor", repeats),
            "cli_first_s": first_s,
            "cli_s": min(_call(robot, file)[0] for _ in range(repeats)),
        }


def _import_s(statement: str, repeats: int) -> float:
    code = f"import time; begin = time.perf_counter(); {statement}; print(time.perf_counter() - begin)"
    command = [sys.executable, "-c", code]
    return min(float(subprocess.run(command, check=True, capture_output=True).stdout) for _ in range(repeats))


def _call(robot: str, file: Path, **environment: str) -> tuple[float, str]:
    command = [sys.executable, "-m", "tactful", "monitor", str(file), "--robot", robot]
    begin = time.perf_counter()
    done = subprocess.run(command, check=True, capture_output=True, text=True, env=os.environ | environment)
    return time.perf_counter() - begin, done.stderr
