"""Tuning to planned impacts: thresholds, bounds on the rate, and the search, on made impacts."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tactful.classification import AimAware, AimAwareConfig
from tactful.cli import _tune_aim_aware
from tactful.cli._app import main
from tactful.impacts import ContactPoint, ImpactPlan
from tactful.learning import (
    THRESHOLDS,
    ImpactRates,
    Judged,
    LabelledImpact,
    LearningError,
    thresholds_for,
    tune_impacts,
    within,
)
from tactful.monitor import MonitorConfig
from tactful.recordings import Label, Recording
from tactful.simulation.planar import planar_robot, simulate_impact

PLAN = ImpactPlan(0.3, [0.1, -0.2], [0.3], [[0.2, 0.0]], turn=[[0.0, 0.0], [1.0, 1.0]])


def made(offset_rad_s: float, *, jump_nm: float = 12.0, noise_nm: float = 0.0, tilt_rad: float = 0.0) -> LabelledImpact:
    """An impact at 0.3 s after which the first joint rings about the plan with an offset."""
    t = np.arange(0.1, 0.6, 1e-3)
    since = np.maximum(t - 0.3, 0.0)
    dq = np.tile([0.2, 0.0], (len(t), 1)) + np.where(t[:, None] > 0.3, [offset_rad_s, 0.0], 0.4)
    dq[:, 0] += 0.3 * np.exp(-since / 0.02) * np.sin(180 * since)
    r = np.where(t[:, None] >= 0.3 - 1e-9, [jump_nm, -0.2 * jump_nm], 0.0)
    r += noise_nm * np.random.default_rng(0).standard_normal(r.shape)
    q = np.tile(PLAN.q_d, (len(t), 1)) + np.where(t[:, None] > 0.3, [tilt_rad, 0.0], 0.0)
    expected = bool(within(offset_rad_s, 0.1))
    return LabelledImpact(f"{offset_rad_s:g}", PLAN, t, q, dq, r, touch_s=0.3, expected=expected)


RUNS = [made(float(offset)) for offset in np.linspace(-0.4, 0.4, 17)]


def test_thresholds_after_the_fact_give_the_verdict_of_the_classifier() -> None:
    """The tuning rests on that: what was judged once accepts exactly what the classifier calls expected."""
    runs = [made(0.05, tilt_rad=tilt) for tilt in (0.0, 0.01, 0.03)] + RUNS
    for config in (AimAwareConfig(e_m_rad_s=0.12, tilt_deg=1.0), AimAwareConfig(e_m_rad_s=0.2, m_c=30)):
        accepted = Judged.of(runs, config).accepted(config)
        for run, expected in zip(runs, accepted, strict=True):
            aim = AimAware(run.plan, config)
            aim.run(run.t, run.q, run.dq, run.r)
            assert (aim.verdict == "expected") == expected
        assert accepted.any()
        assert not accepted.all()


def test_thresholds_are_what_the_expected_need_and_a_margin() -> None:
    """Each is the largest needed value times its margin, or the floor below which noise would exceed it."""
    needed = np.array([0.1, 0.2, 9.0])
    seen = Judged(
        *np.zeros((3, 3)), needed[:, None], tilt_deg=np.array([-2.0, 1.0, 0.0]), verdict_s=needed, wait_s=needed
    )
    thresholds = thresholds_for(seen, np.array([True, True, False]), tilt=True)
    assert thresholds is not None
    assert thresholds == pytest.approx(dict(zip(THRESHOLDS, (0.26, 0.005, 0.005, 0.005, 2.1), strict=True)))
    unfelt = replace(seen, needed_rad_s=np.full((3, 1), np.inf))
    assert thresholds_for(unfelt, np.array([True, True, False])) is None


def test_rates_lie_between_noise_and_the_weakest_impact() -> None:
    """By ratio to the usual impact, so that joints may differ; a joint that hardly feels it is left out."""
    quiet = [made(0.0), made(0.0, jump_nm=6.0), made(0.0)]
    rates = ImpactRates.of(quiet)
    assert rates.usual_nm_s == pytest.approx([12000.0, 2400.0])
    assert rates.weakest == pytest.approx(0.5)
    assert rates.between(1.0) == pytest.approx((6000.0, 1200.0))
    assert rates.between(0.0)[0] == pytest.approx(0.03 * 6000)  # the decay of r, where there is no noise
    with pytest.raises(LearningError, match="not told from noise"):
        ImpactRates.of([made(0.0, jump_nm=0.5, noise_nm=0.2)])


def test_accepts_what_is_expected_and_little_else() -> None:
    """The search finds settings whose band is the wanted one, and says what limits it."""
    tuning = tune_impacts(RUNS, trials=8)
    accepted = [
        run.name for run, yes in zip(RUNS, Judged.of(RUNS, tuning.config).accepted(tuning.config), strict=True) if yes
    ]
    assert set(accepted) >= {run.name for run in RUNS if run.expected}
    assert len(accepted) <= 7
    assert tuning.nearest is not None
    assert tuning.nearest[1] == "e_m_rad_s"
    assert tuning.gap > 1
    assert abs(float(tuning.needed_by["e_m_rad_s"])) == pytest.approx(0.1)
    again = tune_impacts(RUNS, trials=8)
    assert again.config == tuning.config
    with pytest.raises(LearningError, match="17 of 17 impacts are expected"):
        tune_impacts([replace(run, expected=True) for run in RUNS], trials=4)


def test_command_line_simulates(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Without recordings the planar arm is simulated; what comes out is a file of settings that loads."""
    monkeypatch.setattr(_tune_aim_aware, "_LEARN", 30)
    monkeypatch.setattr(_tune_aim_aware, "_HELD_OUT", 15)
    out = tmp_path / "monitor.toml"
    assert main(["tune", "--aim-aware", "--tolerance-deg", "3", "--tilt", "--trials", "4", "-o", str(out)]) == 0
    shown = capsys.readouterr().out
    for word in ("e_m_rad_s", "tilt_deg", "held out", "at 95 % confidence"):
        assert word in shown
    config = MonitorConfig.load(out)
    assert config.aim_aware.tilt_deg == pytest.approx(3.15, abs=0.1)


def test_says_what_the_tilt_would_change() -> None:
    """Who cannot keep others out by the paper's conditions, as with friction, has to learn what would."""
    offsets = np.linspace(-0.4, 0.4, 17)
    runs = [made(float(x), tilt_rad=0.1 * float(x)) for x in offsets]
    config = tune_impacts(RUNS, trials=4).config.model_copy(update={"e_m_rad_s": 0.5})
    said = _tune_aim_aware._with_tilt(config, runs, runs)
    assert "0 of 12 others would be accepted and 0 of 5 expected ones refused" in said
    bare = [replace(run, plan=replace(PLAN, turn=None)) for run in runs]
    assert "contact points" in _tune_aim_aware._with_tilt(config, bare, bare)


def test_a_recording_becomes_what_the_monitor_sees() -> None:
    """The residual, the label and the window are those of the recording."""
    run = simulate_impact(90.0, 0.3, 0.0)
    label = Label("expected_impact", run.touches[0].time_s, run.touches[-1].time_s)
    recording = Recording(run.t, {"q": run.q, "dq": run.dq, "tau": run.tau}, (label,), source="run.csv")
    settings = MonitorConfig().model_copy(update={"aim_aware": AimAwareConfig(bandwidth_hz=50 / 2 / np.pi)})
    settings = settings.model_copy(
        update={"observer": settings.observer.model_copy(update={"joint_flexibility": True})}
    )
    found = LabelledImpact.of_recording(recording, run.plan, planar_robot(), settings)
    assert found.expected
    assert found.touch_s == run.touches[0].time_s
    rows = np.isin(run.t, found.t)
    assert found.r == pytest.approx(run.r[rows], abs=1e-6)
    early = (replace(recording.labels[0], kind="expected_impact", start_s=0.1),)
    with pytest.raises(LearningError, match=r"touches at 0.100 s, but its plan speaks from 0.3"):
        LabelledImpact.of_recording(replace(recording, labels=early), run.plan, planar_robot(), settings)
    with pytest.raises(LearningError, match="0 labels"):
        LabelledImpact.of_recording(replace(recording, labels=()), run.plan, planar_robot(), settings)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ([], "which recordings"),
        (["--aim-aware", "--trials", "1"], "--trials"),
        (["--aim-aware", "--tolerance-deg", "-1"], "--tolerance-deg"),
        (["--aim-aware", "--robot", "panda"], "which recordings"),
        (["--aim-aware", "nothing.csv", "--robot", "panda"], "nothing.csv"),
    ],
)
def test_bad_input_is_one_line(arguments: list[str], message: str, capsys: pytest.CaptureFixture[str]) -> None:
    """A slip in an option ends in one line."""
    assert main(["tune", *arguments]) == 2
    error = capsys.readouterr().err
    assert message in error
    assert error.count("\n") == 1


def test_the_turn_of_the_tool_needs_contacts() -> None:
    """A plan without contact points knows neither tool nor surface."""
    robot = planar_robot()
    plan = ImpactPlan(0.3, robot.home, [0.3], [[0.0] * 3])
    with pytest.raises(Exception, match="contacts are empty"):
        plan.with_turn(robot)
    flat = replace(plan, contacts=(ContactPoint(2, np.array([0.22, 0.0, 0.0]), np.array([0.0, 1.0, 0.0])),))
    assert np.abs(flat.with_turn(robot).turn) == pytest.approx(np.array([[0.0] * 3, [1.0] * 3]), abs=1e-12)
