"""A cache of compiled kernels that several processes fill has to be one that a further process can use."""

import os
import subprocess
import sys
from pathlib import Path

KERNEL = """
import sys
import numpy as np
from tactful._njit import njit


@njit(cache=True)
def last(record, start):  # too long and too often called to be inlined
    x = start
    for i in range(record.values.shape[0]):
        x += np.sin(record.values[i]) * np.exp(-x * x) + np.cos(x) * np.tanh(record.values[i] + x)
        for j in range(record.values.shape[0]):
            x += np.sqrt(abs(record.values[j])) * np.sin(x + j) - np.log1p(abs(x)) * np.cos(record.values[j] * x)
            x = np.arctan2(x, record.values[j] + 2.0) + np.sinh(x * 0.01) + np.cosh(record.values[i] * 0.01)
    return record.values[record.values.shape[0] - 1] + 0.0 * x


@njit(cache=True)
def entry(records):
    a = last(records[0], 0.1) + last(records[0], 0.2) + last(records[0], 0.3)
    return (a + last(records[0], a) + last(records[0], -a)) / 5.0


def value(width):
    records = np.zeros(1, np.dtype([("values", "f8", (width,)), ("more", "f8")]))
    records["values"] = np.arange(width)
    return entry(records)


for width in map(int, sys.argv[1:]):
    assert value(width) == width - 1, (width, value(width))
"""


def test_kernels_cached_by_two_processes_do_not_take_each_others_place(tmp_path: Path) -> None:
    """Numba alone gives both the same symbol: the third process then reads the wrong field or crashes."""
    script = tmp_path / "kernel.py"
    script.write_text(KERNEL)
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path / "cache")}
    for widths in (["3"], ["7"], ["3", "7"], ["7", "3"]):
        run = subprocess.run(
            [sys.executable, str(script), *widths], env=environment, capture_output=True, text=True, check=False
        )
        assert run.returncode == 0, run.stderr
