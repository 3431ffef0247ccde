"""What makes a served arm as punctual as a real one."""

import contextlib
import os


def run_in_real_time() -> None:
    """Go before all that does not, where that is allowed: so does an arm, and its client gives it up after a second."""
    with contextlib.suppress(OSError):
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(1))
