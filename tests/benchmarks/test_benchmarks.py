"""The benchmarks run: speed is measured by `make bench`, and asserted nowhere."""

import io
import json

import pytest
from rich.console import Console

from benchmarks import Sizes, run
from benchmarks._motion import TOUCH_S, swing
from benchmarks._peers import PinocchioPeer
from benchmarks._report import BOUNDS

KEYS = {
    "chain_batch_us",
    "chain_stream_us",
    "ratio_pinocchio_batch",
    "ratio_pinocchio_stream",
    "ratio_mujoco_batch",
    "hour_s",
    "loop_us",
}


def test_everything_is_measured_and_written(tmp_path):
    """A benchmark that nobody runs breaks unseen; here it runs with tiny sizes, and compares its peers."""
    pytest.importorskip("pinocchio", reason="Pinocchio is not installed")
    file = tmp_path / "build" / "bench.json"
    text = io.StringIO()
    sizes = Sizes(rounds=1, loop_s=0.1, hour_s=3.0, repeats=1, episodes=1, first_call=False)
    result = run(sizes, file, Console(file=text, width=120))
    written = json.loads(file.read_text())
    assert written == json.loads(json.dumps(result))
    assert written.keys() >= KEYS | {key for key, *_ in BOUNDS}
    assert written["loop_us"].keys() >= {"p50", "p99", "p99_9", "max"}
    assert all(written[key] > 0 for key in KEYS - {"loop_us"})
    assert "whole chain in batch" in text.getvalue()


def test_a_peer_that_computes_something_else_is_refused():
    """A ratio to a wrong observer says nothing: the comparison has to notice a wrong term."""
    pytest.importorskip("pinocchio", reason="Pinocchio is not installed")
    import numpy as np

    from benchmarks._chain import compare
    from tactful import Monitor, MonitorConfig, Robot, TactfulError

    class Wrong(PinocchioPeer):
        def terms(self, q, dq):
            p, ctdq, g, J = super().terms(q, dq)
            return p, -ctdq, g, J

    robot = Robot.load("panda")
    recording = swing(robot, 0.5, np.random.default_rng(0))
    assert TOUCH_S[0] > 0.5
    with pytest.raises(TactfulError, match="its tau_ext differs"):
        compare("wrong", Wrong(robot, MonitorConfig()), Monitor(robot), recording)
