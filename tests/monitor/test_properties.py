"""What holds for any stream of samples, however broken."""

import numpy as np
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from tactful import Monitor, MonitorConfig, Recording
from tactful.monitor import Timeline

RATE_HZ = 100.0
CONFIG = MonitorConfig().fitted_to(RATE_HZ)
values = st.floats(allow_nan=True, allow_infinity=True, width=64)
forces = st.lists(
    st.one_of(st.floats(-30, 30), values, st.just(float("nan")), st.just(1e300)), min_size=0, max_size=300
)
calm = settings(deadline=None, max_examples=60, suppress_health_check=[HealthCheck.too_slow])


def timeline(t: np.ndarray, force: np.ndarray) -> tuple[Monitor, Timeline]:
    """Monitor a wrench along z."""
    wrench = np.zeros((len(t), 6))
    wrench[:, 2] = force
    monitor = Monitor(config=CONFIG)
    rec = Recording(t=t, channels={"wrench": wrench}, source="any", format="made")
    return monitor, monitor.run(rec, trace=True)


@calm
@given(forces)
def test_any_value_gives_a_consistent_timeline(force: list[float]) -> None:
    """Whatever the values are, counts add up, contacts are in order, and nothing raises."""
    x = np.array([0.0] * 60 + force)
    with np.errstate(all="ignore"):
        monitor, result = timeline(np.arange(len(x)) / RATE_HZ, x)
    assert result.health.samples == len(x)
    assert result.health.nonfinite == np.count_nonzero(~(np.abs(x) < 1e9))
    for event in result:
        assert event.onset_s <= event.detected_s
        assert event.end_s is None or event.onset_s <= event.end_s <= result.end_s
        assert event.kind == "contact"
    assert [event.id for event in result] == list(range(len(result)))
    assert sorted(event.detected_s for event in result) == [event.detected_s for event in result]
    assert (monitor.contact is not None) == bool(result.events and result.events[-1].end_s is None)


@calm
@given(
    st.lists(st.one_of(st.floats(-0.02, 0.03), st.floats(-1, 5), st.just(float("nan"))), min_size=60, max_size=300),
    st.integers(0, 2**32 - 1),
)
def test_any_clock_is_counted_and_survived(steps: list[float], seed: int) -> None:
    """Time that repeats, goes back, jumps or is not a number: skipped or started anew, never an error."""
    t = np.cumsum(np.nan_to_num(steps)) + np.where(np.isnan(steps), np.nan, 0)
    rec = Recording(
        t=t,
        channels={"wrench": np.random.default_rng(seed).normal(size=(len(t), 6))},
        source="any",
        format="made",
    )
    monitor = Monitor(config=CONFIG)
    seen, last = 0, None
    backward = gaps = nonfinite = 0
    for k in range(len(t)):
        monitor.update(float(t[k]), wrench=rec.channels["wrench"][k])
        seen += 1
        if not np.isfinite(t[k]):
            nonfinite += 1
        elif last is not None and t[k] <= last:
            backward += 1
        else:
            gaps += last is not None and t[k] - last > CONFIG.contact.gap_s
            last = t[k]
    health = monitor.health
    assert (health.samples, health.nonfinite, health.backward, health.gaps) == (seen, nonfinite, backward, gaps)


@calm
@given(st.integers(0, 2**32 - 1), st.integers(0, 250))
def test_a_broken_sample_changes_nothing_after_it(seed: int, where: int) -> None:
    """One NaN is as if the sample had not been sent: the later levels are those of the stream without it."""
    rng = np.random.default_rng(seed)
    x = np.cumsum(rng.normal(size=300)) * 0.3
    t = np.arange(300) / RATE_HZ
    broken = x.copy()
    broken[where] = np.nan
    kept = np.delete(np.arange(300), where)
    _, with_nan = timeline(t, broken)
    _, without = timeline(t[kept], x[kept])
    np.testing.assert_array_equal(with_nan.trace["level"][kept], without.trace["level"])
    assert with_nan.events == without.events
