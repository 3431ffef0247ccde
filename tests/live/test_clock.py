"""Waiting: a machine that is busy elsewhere must not be taken for an arm that is silent."""

import pytest

from tactful.live import _clock


def test_time_in_which_the_process_stood_still_does_not_count(monkeypatch: pytest.MonkeyPatch) -> None:
    """A process that gets no processor for seconds has not heard because it did not listen."""
    now = 100.0
    monkeypatch.setattr(_clock.time, "monotonic", lambda: now)
    patience = _clock.Patience(1.0, 0.01)
    now += 5.0
    assert not patience.over()
    looks = 0
    while not patience.over():
        now += 0.005
        looks += 1
    assert looks == pytest.approx(0.99 / 0.005, abs=2)
