"""What is planned for an impact."""

import pickle
from pathlib import Path

import numpy as np
import pytest

from tactful.impacts import ContactPoint, ImpactPlan, ImpactPlanError
from tactful.recordings import Label, Recording

PLAN = ImpactPlan(
    0.5,
    [0.1, 0.2],
    [0.4, 0.5, 0.7],
    [[0.0, 1.0], [0.0, 2.0], [1.0, 2.0]],
    contacts=(ContactPoint(1, [0.1, 0.0, 0.0], [0.0, 1.0, 0.0]),),
)


@pytest.mark.parametrize(
    ("t", "expected"), [(-9, [0, 1]), (0.4, [0, 1]), (0.45, [0, 1.5]), (0.6, [0.5, 2]), (0.7, [1, 2]), (9, [1, 2])]
)
def test_reference_is_linear_between_and_constant_beyond(t: float, expected: list[float]) -> None:
    """An impact may come before t_d or long after: the reference has to have a value then."""
    np.testing.assert_allclose(PLAN.dq_d(t), expected, atol=1e-12)


def test_one_row_is_a_constant_velocity() -> None:
    """The least that an impact map says is one velocity."""
    np.testing.assert_array_equal(ImpactPlan(0.5, [0.0], [0.5], [[3.0]]).dq_d(2.0), [3.0])


def test_is_immutable_and_pickles() -> None:
    """Plans go to worker processes and must not change under the monitor."""
    copy = pickle.loads(pickle.dumps(PLAN))
    for plan in (PLAN, copy):
        with pytest.raises(ValueError, match="read-only"):
            plan.post_dq[0, 0] = 1.0
    np.testing.assert_array_equal(copy.post_dq, PLAN.post_dq)
    assert (PLAN.start_s, PLAN.end_s, PLAN.n) == (0.3, 1.0, 2)


def test_saves_and_loads(tmp_path: Path) -> None:
    """A plan is made once and used by every run of the cell."""
    PLAN.save(tmp_path / "plan.npz")
    copy = ImpactPlan.load(tmp_path / "plan.npz")
    for name in ("t_d_s", "q_d", "post_t_s", "post_dq", "window_s", "source", "post_q"):
        np.testing.assert_array_equal(getattr(copy, name), getattr(PLAN, name))
    np.testing.assert_array_equal(copy.contacts[0].point_m, PLAN.contacts[0].point_m)
    assert copy.contacts[0].link == 1


@pytest.mark.parametrize(
    ("change", "field"),
    [
        ({"t_d_s": np.nan}, "t_d_s"),
        ({"q_d": []}, "q_d"),
        ({"q_d": [0.0]}, "post_dq"),
        ({"post_t_s": [0.4, 0.4, 0.7]}, "post_t_s"),
        ({"post_t_s": [[0.4]]}, "post_t_s"),
        ({"post_q": [[0.0, 0.0]]}, "post_q"),
        ({"window_s": (0.1, 0.0)}, "window_s"),
        ({"source": "guess"}, "source"),
    ],
)
def test_what_cannot_be_is_refused(change: dict[str, object], field: str) -> None:
    """A plan that is wrong would only show as a wrong verdict."""
    fields = {name: getattr(PLAN, name) for name in ("t_d_s", "q_d", "post_t_s", "post_dq")} | change
    with pytest.raises(ImpactPlanError, match=field) as error:
        ImpactPlan(**fields)  # type: ignore[arg-type]
    assert error.value.field == field


@pytest.mark.parametrize(
    ("name", "content"), [("missing.npz", None), ("torn.npz", b"PK\x03\x04no"), ("text.npz", b"a")]
)
def test_files_that_are_no_plans(tmp_path: Path, name: str, content: bytes | None) -> None:
    """Whatever the file is, the answer is one line."""
    if content is not None:
        (tmp_path / name).write_bytes(content)
    with pytest.raises(ImpactPlanError, match="file"):
        ImpactPlan.load(tmp_path / name)


def test_another_archive_is_no_plan(tmp_path: Path) -> None:
    """A recording is an archive too."""
    np.savez(tmp_path / "log.npz", t=np.zeros(3))
    with pytest.raises(ImpactPlanError, match="not an impact plan"):
        ImpactPlan.load(tmp_path / "log.npz")


def _nominal(t_impact: float, phase: float) -> Recording:
    t = np.arange(0, 1, 1e-3)
    since = t - t_impact
    gross = np.stack([0.4 - 1.0 * since, -0.3 + 2.0 * since], axis=1)
    ring = np.exp(-since / 0.03) * np.sin(2 * np.pi * 30 * since + phase)
    dq = np.where(since[:, None] > 0, gross + 0.2 * ring[:, None], 1.0)
    return Recording(t, {"q": np.cumsum(dq, axis=0) * 1e-3, "dq": dq}, (Label("impact", t_impact, t_impact),))


def test_learns_the_gross_motion_from_ringing_runs() -> None:
    """The ringing of 0.2 rad/s must not become part of the reference."""
    runs = [_nominal(t, phase) for t, phase in [(0.50, 0.0), (0.49, 1.0), (0.51, 3.0), (0.50, 4.5)]]
    plan = ImpactPlan.from_recordings(runs)
    assert plan.source == "recorded"
    assert plan.t_d_s == pytest.approx(0.5)
    for since in (0.05, 0.1, 0.15):
        np.testing.assert_allclose(plan.dq_d(0.5 + since), [0.4 - since, -0.3 + 2 * since], atol=0.02)


def test_recordings_that_say_too_little() -> None:
    """Each gap is told, instead of a reference that is made up."""
    run = _nominal(0.5, 0.0)
    no_label = Recording(run.t, run.channels)
    no_dq = run.with_channels(dq=None)
    for runs, times, match in [
        ([], None, "empty"),
        ([no_label], None, "time of the impact"),
        ([run], [0.5, 0.6], "give one each"),
        ([no_dq], None, "q and dq"),
        ([run], [0.999], "give more rows"),
    ]:
        with pytest.raises(ImpactPlanError, match=match):
            ImpactPlan.from_recordings(runs, times)
