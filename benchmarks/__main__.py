"""Measure all, print the tables, write `build/bench.json`."""

import sys
from pathlib import Path

from rich.console import Console

from benchmarks import Sizes, run
from tactful import TactfulError

try:
    run(Sizes(), Path("build/bench.json"), Console())
except TactfulError as error:
    sys.exit(f"benchmarks: {error}")
