"""The aim-aware classifier against Algorithm 1, transcribed with whole arrays, and case by case."""

import copy
import itertools
import math
import pickle
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from tactful.classification import VERDICTS, AimAware, AimAwareConfig, AimAwareResult
from tactful.config import ConfigError
from tactful.detection import ImpactConfig
from tactful.errors import TactfulError
from tactful.impacts import ImpactPlan

Array = NDArray[np.float64]
Rows = tuple[Array, Array, Array, Array]

R_B = 4000.0
PLAN = ImpactPlan(
    0.3,
    [0.1, -0.2],
    [0.25, 0.3, 0.35, 0.5],
    [[0.2, 0.0], [0.2, 0.0], [0.1, 0.1], [0.0, 0.2]],
    window_s=(0.2, 0.3),
)


def run_of(
    blows: list[float],
    *,
    offset: tuple[float, float] = (0.0, 0.0),
    displaced_rad: float = 0.0,
    seed: int | None = None,
    plan: ImpactPlan = PLAN,
) -> Rows:
    """Samples of 0.6 s in which each blow lets both joints ring about the plan's reference plus an offset [rad/s]."""
    t = np.arange(600) * 1e-3
    dq = np.stack([plan.dq_d(time) for time in t]) + np.where(t[:, None] > 0.3, offset, 0.4)
    r = np.zeros((600, 2))
    for blow in blows:
        since = np.maximum(t - blow, 0.0)
        dq += (0.5 * np.exp(-since / 0.03) * np.sin(180 * since))[:, None] * [1.0, -0.6]
        r += np.where(t[:, None] >= blow - 1e-9, [12.0, -6.0], 0.0)
    q = np.tile(plan.q_d, (600, 1)) + displaced_rad * np.array([0.6, 0.8])
    if seed is not None:
        rng = np.random.default_rng(seed)
        dq += 0.05 * rng.standard_normal(dq.shape)
        q += 0.02 * rng.standard_normal(q.shape)
    return t, q, dq, r


def algorithm_1(plan: ImpactPlan, config: AimAwareConfig, rows: Rows, *, literal: bool) -> tuple[list[str], Array]:
    """Verdicts of all samples and e_m needed, from the text of the paper; what is corrected is marked."""
    t, q, dq, r = rows
    n = q.shape[1]
    rate = np.abs(np.diff(r, axis=0, prepend=r[:1]) / np.diff(t, prepend=t[0] - 1e-3)[:, None])
    e = dq - np.stack([np.array([np.interp(x, plan.post_t_s, plan.post_dq[:, i]) for i in range(n)]) for x in t])
    eps = 1e-9
    impacts: list[int] = []
    verdicts: list[str] = []
    lower = upper = np.zeros(n)
    m, inst, post, impact, done = 1, "yet unknown", "off", "off", False
    needed = np.full(n, -np.inf)
    for k in range(len(t)):
        blow = k > 1 and bool(np.any((rate[k] >= R_B) & (rate[k - 1] < R_B)))
        if not literal and (done or not plan.start_s - eps <= t[k] <= plan.end_s + eps):  # corrected
            blow = False
        if blow:
            impacts.append(k)
            m = 1 if literal else 0  # corrected
            judged = impacts[-1:] if literal else impacts  # corrected: all j
            fits = all(abs(t[j] - plan.t_d_s) <= config.zeta_s + eps for j in judged)
            fits = fits and all(np.linalg.norm(q[j] - plan.q_d) <= config.epsilon_rad for j in judged)
            pairs = list(itertools.pairwise(impacts))
            fits = fits and all(t[b] - t[a] <= config.iota_s + eps for a, b in (pairs[-1:] if literal else pairs))
            inst, post = ("expected", "yet unknown") if fits else ("unexpected", "unexpected")
            lower, upper = e[k], e[k]
            needed = np.full(n, -np.inf)
        elif impacts:
            window = e[k - m : k + 1]
            share = config.a_per_s * (t[k] - t[k - 1])
            lower = np.minimum(window.min(axis=0), (1 - share) * lower + share * window.min(axis=0))
            upper = np.maximum(window.max(axis=0), (1 - share) * upper + share * window.max(axis=0))
        if not config.envelope:
            lower = upper = e[k]
        t_j = t[impacts[0 if config.xi_from == "first" else -1]] if impacts else -np.inf
        over = t[k] - t_j > config.xi_s + eps
        judge = bool(impacts) and k - impacts[-1] >= config.m_c
        if judge and not done and t[k - 1] - t_j <= config.xi_s + eps:
            needed = np.maximum(needed, np.maximum(lower, -upper))
        if post == "yet unknown":
            e_m = config.margins(n)
            if judge and not np.all((lower - e_m <= 0) & (upper + e_m >= 0)):
                post = "unexpected"
            elif over:
                post = "expected"
        if post != "yet unknown" and over and (literal or (impacts and not done)):  # corrected
            impact = "expected" if inst == post == "expected" else "unexpected"
            done = not literal
        if not literal and not impacts:  # corrected
            late = t[k] > plan.t_d_s + config.zeta_s + eps
            impact = "missed" if late else "yet unknown" if t[k] >= plan.start_s - eps else "off"
        verdicts.append(impact)
        m = min(m + 1, config.m_max)
    return verdicts, needed


def random_case(seed: int) -> tuple[AimAwareConfig, Rows]:
    """Settings and blows of all sorts, so that every branch is taken by some."""
    rng = np.random.default_rng(seed)
    blows = np.sort(rng.uniform(0.12, 0.5, rng.integers(0, 5))).round(3).tolist()
    config = AimAwareConfig(
        impact=ImpactConfig(r_b_nm_s=R_B, refractory_s=0),
        m_max=int(rng.integers(1, 40)),
        m_c=int(rng.integers(0, 30)),
        a_per_s=rng.uniform(5, 40),
        epsilon_rad=rng.uniform(0.02, 0.2),
        zeta_s=rng.uniform(0.05, 0.2),
        iota_s=rng.uniform(0.02, 0.2),
        e_m_rad_s=(rng.uniform(0, 0.2), rng.uniform(0, 0.2)),
        xi_s=rng.uniform(0.04, 0.12),
        envelope=bool(rng.random() < 0.8),
    )
    offset = rng.uniform(-0.2, 0.2, 2)
    rows = run_of(blows, offset=(offset[0], offset[1]), displaced_rad=rng.uniform(0, 0.1), seed=seed)
    return config, rows


def named(codes: Any) -> list[str]:
    """The verdicts that the codes mean."""
    return [VERDICTS[int(code)] for code in codes]


@pytest.mark.parametrize(("literal", "xi_from"), [(False, "last"), (True, "last"), (False, "first")])
def test_equals_the_algorithm(literal: bool, xi_from: str) -> None:
    """Another hand wrote it from the paper, with windows cut out of whole arrays: every sample has to agree."""
    seen = set()
    for seed in range(60):
        config, rows = random_case(seed)
        config = config.model_copy(update={"variant": "literal" if literal else "corrected", "xi_from": xi_from})
        aim = AimAware(PLAN, config)
        expected, needed = algorithm_1(PLAN, config, rows, literal=literal)
        assert named(aim.run(*rows)) == expected, f"seed {seed}"
        np.testing.assert_allclose([joint.needed_rad_s for joint in aim.result.joints], needed, atol=1e-12)
        seen.add(aim.verdict)
    assert seen == ({"expected", "unexpected"} if literal else {"expected", "unexpected", "missed"})


def expected_by(result: AimAwareResult, config: AimAwareConfig) -> bool:
    """The verdict from the evidence and thresholds alone."""
    return (
        abs(result.timing_s) <= config.zeta_s + 1e-9
        and result.position_rad <= config.epsilon_rad
        and result.spacing_s <= config.iota_s + 1e-9
        and all(joint.needed_rad_s <= e_m for joint, e_m in zip(result.joints, config.margins(2), strict=True))
    )


def test_the_evidence_tells_the_verdict_for_any_thresholds() -> None:
    """Tuning relies on it: one run says what every threshold would have to be."""
    decided = 0
    for seed in range(40):
        config, rows = random_case(seed)
        other, _ = random_case(seed + 1000)
        names = ("epsilon_rad", "zeta_s", "iota_s", "e_m_rad_s")
        changed = config.model_copy(update={name: getattr(other, name) for name in names})
        results = []
        for settings in (config, changed):
            aim = AimAware(PLAN, settings)
            aim.run(*rows)
            results.append(aim.result)
        for result in results:
            if result.judged and result.decided_s is not None:
                decided += 1
                assert (results[1].verdict == "expected") == expected_by(result, changed), f"seed {seed}"
    assert decided > 40


def test_stream_is_batch() -> None:
    """A loop at 1 kHz and an analysis afterwards have to agree bit for bit, also across a copy."""
    for seed in range(4):
        config, rows = random_case(seed)
        batch, stream = AimAware(PLAN, config), AimAware(PLAN, config)
        trace = batch.trace(*rows)
        first = [stream.update(*sample) for sample in zip(*(x[:320] for x in rows), strict=True)]
        stream = pickle.loads(pickle.dumps(copy.copy(stream)))
        rest = stream.run(*(x[320:] for x in rows))
        assert first + named(rest) == named(trace.verdict)
        assert stream._record.tobytes() == batch._record.tobytes()


def verdict_of(rows: Rows, plan: ImpactPlan = PLAN, **settings: Any) -> AimAwareResult:
    """What a fresh classifier says of the rows."""
    aim = AimAware(plan, AimAwareConfig(**settings))
    aim.run(*rows)
    return aim.result


def test_as_planned() -> None:
    """Ringing alone is no deviation: that is the purpose of the envelope, and the raw error cannot do it."""
    rows = run_of([0.302])
    result = verdict_of(rows)
    assert (result.verdict, result.instant) == ("expected", "expected")
    assert result.decided_s == pytest.approx(0.302 + 0.101)
    assert result.needed_rad_s < 0.02
    assert result.evidence[0].text.startswith("expected: ")
    assert result.confidence > 0.8
    assert verdict_of(rows, envelope=False).verdict == "unexpected"
    raw = AimAware(PLAN, AimAwareConfig.raw_error())
    raw.run(*rows)
    assert raw.verdict == "expected"


@pytest.mark.parametrize(
    ("rows", "rule", "text"),
    [
        (run_of([0.19]), "timing", "110 ms early"),
        (run_of([0.41]), "timing", "110 ms late"),
        (run_of([0.3], displaced_rad=0.1), "place", "0.100 rad from its place"),
        (run_of([0.3], offset=(0.3, 0.0)), "envelope", "joint 1 too fast"),
        (run_of([0.3], offset=(0.0, -0.4)), "envelope", "joint 2 too slow"),
    ],
)
def test_says_what_is_wrong(rows: Rows, rule: str, text: str) -> None:
    """An operator has to be told more than that it was unexpected."""
    result = verdict_of(rows)
    assert result.verdict == "unexpected"
    assert result.evidence[0].rule == rule
    assert text in result.evidence[0].text
    assert result.evidence[0].value > result.evidence[0].threshold  # type: ignore[operator]
    assert result.confidence > 0.5


def test_evidence_of_the_joints() -> None:
    """Which joint violated which bound, since when and by how much."""
    result = verdict_of(run_of([0.3], offset=(0.3, 0.0)))
    fast, good = result.joints
    assert fast.bound == "lower"
    assert fast.violated_s is not None
    assert 0.315 <= fast.violated_s <= 0.4
    assert fast.excess_rad_s == pytest.approx(fast.needed_rad_s - 0.1)
    assert fast.at_s == 0.315
    assert 0.3 < fast.needed_rad_s < 0.45  # the offset and the ringing at 15 ms
    assert (good.violated_s, good.excess_rad_s) == (None, 0.0)


def test_missed_and_too_late() -> None:
    """An impact that never comes had no verdict in the paper; one that comes afterwards is judged all the same."""
    missed = verdict_of(run_of([]))
    assert (missed.verdict, missed.judged, missed.confidence) == ("missed", 0, 1.0)
    assert missed.decided_s == pytest.approx(0.401)
    assert missed.evidence[0].rule == "missed"
    late = verdict_of(run_of([0.45]))
    assert (late.verdict, late.timing_s) == ("unexpected", pytest.approx(0.15))
    assert verdict_of(run_of([0.41]), missed_s=0.2).verdict == "unexpected"
    assert verdict_of(run_of([]), missed_s=0.05).decided_s == pytest.approx(0.351)


def test_a_plan_that_nobody_watched_is_not_missed() -> None:
    """A monitor that starts after the planned impact has not seen whether it came."""
    aim = AimAware(PLAN)
    aim.run(*(x[450:] for x in run_of([])))
    assert (aim.verdict, aim.result.evidence) == ("off", ())


def test_the_first_verdict_stays() -> None:
    """As printed, a later impact forgives what was violated before it, even after the verdict."""
    rows = run_of([0.3, 0.43], offset=(0.3, 0.0))
    rows[2][425:] -= [0.3, 0.0]
    settings = {"xi_s": 0.1, "zeta_s": 0.2, "iota_s": 0.2}
    corrected = verdict_of(rows, **settings)
    assert (corrected.verdict, corrected.judged, len(corrected.impact_s)) == ("unexpected", 1, 2)
    assert verdict_of(rows, variant="literal", **settings).verdict == "expected"


def test_the_verdict_can_come_after_the_first_impact() -> None:
    """An arm that lands edge after edge is judged in time; what comes later does not put the verdict off."""
    rows = run_of([0.3, 0.36, 0.42])
    last, first = verdict_of(rows), verdict_of(rows, xi_from="first")
    assert (last.judged, first.judged) == (3, 2)
    assert last.decided_s == pytest.approx(0.42 + 0.101)
    assert first.decided_s == pytest.approx(0.3 + 0.101)


def test_speaks_in_its_window_only() -> None:
    """What is struck before the plan's window is a collision, of which another classifier speaks."""
    result = verdict_of(run_of([0.05, 0.3]))
    assert (result.verdict, result.impact_s) == ("expected", (0.3,))
    assert verdict_of(run_of([0.05, 0.3]), variant="literal").judged == 2


def test_bad_samples_are_skipped() -> None:
    """A lost packet or a NaN must not decide: they are counted, and the verdict is that of the others."""
    rows = run_of([0.302])
    good = verdict_of(rows)
    t, q, dq, r = (x.copy() for x in rows)
    rows_bad = [np.insert(x, 330, x[329], axis=0) for x in (t, q, dq, r)]  # time stands still
    rows_bad[2][100] = math.nan
    rows_bad[0][200] = math.inf
    result = verdict_of((rows_bad[0], rows_bad[1], rows_bad[2], rows_bad[3]))
    assert result.skipped == 3
    assert (result.verdict, result.decided_s, result.needed_rad_s) == ("expected", good.decided_s, good.needed_rad_s)


def test_features_for_a_finer_verdict() -> None:
    """Positions at the impacts, the largest rate, and the mean error in ten parts of the time that is judged."""
    result = verdict_of(run_of([0.3, 0.32], offset=(0.05, 0.0), displaced_rad=0.05))
    np.testing.assert_allclose([result.q_first_rad, result.q_last_rad, result.q_end_rad], [[0.03, 0.04]] * 3)
    np.testing.assert_allclose(result.peak_rate_nm_s, [12e3, -6e3])
    t, _, dq, _ = run_of([0.3, 0.32], offset=(0.05, 0.0))
    e = dq - np.stack([PLAN.dq_d(time) for time in t])
    expected = e[300:400].reshape(10, 10, 2).mean(axis=1)
    np.testing.assert_allclose(result.mean_error_rad_s, expected, atol=1e-12)


def test_reset_forgets() -> None:
    """A cell repeats the same plan with one object."""
    aim = AimAware(PLAN)
    aim.run(*run_of([0.19, 0.3], displaced_rad=0.2))
    aim.reset()
    aim.run(*run_of([0.302]))
    fresh = AimAware(PLAN)
    fresh.run(*run_of([0.302]))
    assert aim._record["verdict"] == fresh._record["verdict"]
    for name in ("needed", "position", "timing", "impact_s", "slots", "counts", "q_first"):
        np.testing.assert_array_equal(aim._record[name], fresh._record[name])


def test_published_sets() -> None:
    """Tab. 1 and Tab. 2, number by number."""
    fields = ("m_max", "m_c", "a_per_s", "epsilon_rad", "zeta_s", "xi_s", "e_m_rad_s", "iota_s")
    expected = {
        "strict": (10, 10, 30, 0.042, 0.1, 0.1, 0.033, 0.1),
        "medium": (15, 15, 18, 0.067, 0.1, 0.1, 0.1, 0.1),
        "wide": (15, 15, 18, 0.115, 0.11, 0.1, 0.236, 0.1),
    }
    for name, values in expected.items():
        config = AimAwareConfig.table1(name)  # type: ignore[arg-type]
        assert tuple(getattr(config, field) for field in fields) == values
        assert config.impact.refractory_s == 0
    for name, values in {"strict": (0.12, 0.18), "wide": (0.15, 0.2)}.items():
        config = AimAwareConfig.table2(name, xi_s=0.2)  # type: ignore[arg-type]
        assert (config.m_max, config.m_c, config.a_per_s, config.xi_s) == (13, 5, 19, 0.2)
        assert (config.epsilon_rad, config.e_m_rad_s) == values
    with pytest.raises(ConfigError, match="strict, medium, wide"):
        AimAwareConfig.table1("narrow")  # type: ignore[arg-type]


def test_another_rate_keeps_the_time_of_the_windows() -> None:
    """The paper counts samples of 1 ms; an arm at 500 Hz has half as many in the same time."""
    config = AimAwareConfig.table1("strict")
    assert (config.fitted_to(500.0).m_max, config.fitted_to(500.0).m_c) == (5, 5)
    assert config.fitted_to(1010.0) is config


def test_bad_input() -> None:
    """Each mistake is told in one line."""
    with pytest.raises(ConfigError, match="3 numbers"):
        AimAware(PLAN, AimAwareConfig(e_m_rad_s=(0.1, 0.1, 0.1)))
    with pytest.raises(ConfigError, match="did you mean 'm_max'"):
        AimAwareConfig(m_mx=3)
    with pytest.raises(TactfulError, match="dq has shape"):
        AimAware(PLAN).run([0.0], [[0.0, 0.0]], [[0.0]], [[0.0, 0.0]])


@pytest.mark.parametrize(
    ("rows", "reason"),
    [
        (run_of([0.302]), None),
        (run_of([]), "missed"),
        (run_of([0.45]), "late"),
        (run_of([0.15]), "early"),
        (run_of([0.3], displaced_rad=0.1), "wrong place"),
        (run_of([0.3], offset=(0.3, 0.0)), "motion"),
    ],
)
def test_reason(rows: Rows, reason: str | None) -> None:
    """A reaction is chosen by it."""
    assert verdict_of(rows).reason == reason
