"""What no test of the live part may leave behind."""

import os
import sys
from collections.abc import Iterator

import pytest

if sys.platform == "linux":

    @pytest.fixture(autouse=True)
    def _priority() -> Iterator[None]:
        """A real-time priority that stays lets all that follows starve the machine."""
        before = os.sched_getscheduler(0)
        yield
        assert os.sched_getscheduler(0) == before
