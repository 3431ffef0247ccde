"""Motion from which nothing can be calibrated."""

from __future__ import annotations

from tactful.errors import TactfulError


class CalibrationError(TactfulError):
    """Recordings that cannot calibrate a robot: `source` says which, `problem` why, and what to do."""

    def __init__(self, source: str, problem: str) -> None:
        self.source, self.problem = source, problem
        super().__init__(f"{source}: {problem}")
