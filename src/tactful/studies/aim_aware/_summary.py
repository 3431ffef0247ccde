"""The figures of the study: bands of the published and of tuned settings, robustness, targets."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Mapping
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from tactful.classification import AimAwareConfig
from tactful.control import ImpactControlConfig
from tactful.detection import ImpactConfig
from tactful.errors import TactfulError
from tactful.impacts import CompliantContactConfig
from tactful.simulation.planar import ArmConfig, PlanarConfig, SensorsConfig, TaskConfig
from tactful.studies.aim_aware._bands import Bands
from tactful.studies.aim_aware._evidence import Judged, cases, judge
from tactful.studies.aim_aware._tune import shapes, tune

Array = NDArray[np.float64]
Figures = dict[str, Any]
Grid = Literal["paper", "fine"]

TOLERANCE_DEG: Mapping[str, float] = {"strict": 0.0, "medium": 2.0, "wide": 4.0}
"""The sets of the paper by the inclination that they always accept."""
R_B_TABLE1 = ImpactConfig(r_b_nm_s=(4000.0, 4000.0, float("inf")), refractory_s=0.0)
"""r_b with which the published sets are judged: the paper gives none."""
_STEP_DEG: Mapping[str, float] = {"paper": 1.0, "fine": 0.25}
_HELD_OUT_STEP_DEG = 0.25


def paper_grid(grid: Grid) -> Array:
    """Return the impacts of the paper's sweep (k, 3); "fine" has its inclinations every 0.25 deg."""
    beta = np.arange(-10.0, 10.01, _STEP_DEG[grid])
    return cases(np.arange(60.0, 120.1, 2.0), 0.2 + 0.02 * np.arange(11), beta)


def training(step_deg: float, reach_deg: float, alphas: int, places: int) -> Array:
    """Return impacts to tune on (k, 3), on the corners of the paper's sweep and between."""
    beta = np.arange(-reach_deg, reach_deg + 1e-6, step_deg)
    return cases(np.linspace(60, 120, alphas), np.linspace(0.2, 0.4, places), beta)


def held_out(step_deg: float, reach_deg: float, alphas: int, places: int) -> Array:
    """Return impacts of approaches and places that nothing was tuned on (k, 3)."""
    beta = np.arange(-reach_deg, reach_deg + 1e-6, step_deg)
    return cases(np.linspace(63, 117, alphas), np.linspace(0.21, 0.39, places), beta)


def raw_shape(impact: ImpactConfig) -> AimAwareConfig:
    """Return the baseline: the velocity error itself, without an envelope."""
    return AimAwareConfig.raw_error(impact=impact)


def variants(base: PlanarConfig) -> Iterator[tuple[str, PlanarConfig]]:
    """Yield what may differ from the assumed arm: a name, and the whole configuration."""

    def change(**parts: Any) -> PlanarConfig:
        return base.model_copy(update=parts)

    rough = CompliantContactConfig(friction=0.2)
    knows = {"task": TaskConfig(friction=0.2), "control": ImpactControlConfig(friction=0.2)}
    loose = ArmConfig(coulomb_nm=(1.0,) * 3, viscous_nms=(1.0,) * 3)
    calibrated = ArmConfig(coulomb_nm=(0.1,) * 3, viscous_nms=(0.1,) * 3)
    r_b_noisy = ImpactConfig(r_b_nm_s=(4000.0, 4000.0, float("inf")))
    yield "as assumed", base
    yield "torque 1 ms late", change(control=ImpactControlConfig(delay_samples=1))
    yield (
        "encoder 1e-5 rad, torque 0.05 Nm, velocity by differences",
        change(sensors=SensorsConfig(encoder_noise_rad=1e-5, torque_noise_nm=0.05, velocity_cutoff_hz=100.0)),
    )
    yield (
        "encoder 5e-5 rad, torque 0.2 Nm, velocity by differences, r_b 4000",
        change(
            sensors=SensorsConfig(encoder_noise_rad=5e-5, torque_noise_nm=0.2, velocity_cutoff_hz=100.0),
            impact=r_b_noisy,
        ),
    )
    yield "contact ten times softer", change(contact=CompliantContactConfig(stiffness=2e6))
    yield "restitution 0.3", change(contact=CompliantContactConfig(restitution=0.3))
    yield "half-width 0.05 m", change(arm=ArmConfig(half_width_m=0.05))
    yield "r_b 1000", change(impact=ImpactConfig(r_b_nm_s=(1000.0, 1000.0, float("inf"))))
    yield "r_b 4000", change(impact=r_b_noisy)
    yield "joint friction 1 Nm + 1 Nms/rad", change(arm=loose)
    yield "joint friction 0.1 Nm + 0.1 Nms/rad, as calibrated", change(arm=calibrated)
    yield "contact friction 0.2, unknown", change(contact=rough)
    yield "contact friction 0.2, known to the map", change(contact=rough, **knows)
    yield "both: contact 0.2 known, joints as calibrated", change(contact=rough, arm=calibrated, **knows)
    yield "both: contact 0.2 unknown, joints 1 + 1", change(contact=rough, arm=loose)


def summarise(
    grid: Grid,
    planar: PlanarConfig,
    seed: int,
    jobs: int,
    progress: Callable[[float], None] = lambda share: None,
) -> Figures:
    """Simulate, judge, tune and count; what comes out is the content of `summary.json`.

    Raises:
        TactfulError: if the grid is unknown or a number is out of range.
    """
    if grid not in _STEP_DEG:
        raise TactfulError(f"grid {grid!r} is unknown: there are {', '.join(_STEP_DEG)}")
    if seed < 0:
        raise TactfulError(f"seed is {seed}: it has to be at least 0")
    tried = [*shapes(planar.impact), raw_shape(planar.impact)]
    learn, unseen, sweep = training(0.25, 6.0, 7, 5), held_out(_HELD_OUT_STEP_DEG, 10.0, 7, 5), paper_grid(grid)
    few, many = (training(0.5, 7.0, 4, 3), held_out(0.5, 10.0, 4, 3)), list(variants(planar))
    total = len(learn) + len(unseen) + len(sweep) + len(many) * sum(map(len, few))
    done = 0

    def count(impacts: int) -> None:
        nonlocal done
        done += impacts
        progress(done / total)

    seen = judge(learn, planar, tried, seed, jobs, count)
    tuned = {name: tune(list(zip(tried, seen, strict=True))[:-1], learn[:, 2], B) for name, B in TOLERANCE_DEG.items()}
    raw = {name: tune([(tried[-1], seen[-1])], learn[:, 2], B) for name, B in TOLERANCE_DEG.items()}
    published = {name: AimAwareConfig.table1(name, impact=R_B_TABLE1) for name in ("strict", "medium", "wide")}
    groups: dict[str, dict[str, AimAwareConfig]] = {"table1": dict(published), "tuned": tuned, "raw": raw}
    configs = [config for group in groups.values() for config in group.values()]
    begin = _cpu_s()
    on_grid = judge(sweep, planar, configs, seed, jobs, count)
    spent = _cpu_s() - begin
    on_unseen = judge(unseen, planar, configs, seed, jobs, count)
    figures: Figures = {"grid": grid, "impacts": len(sweep), "seed": seed, "cpu_s": spent}
    for group, members in groups.items():
        figures[group] = {}
        for name, config in members.items():
            k = configs.index(config)
            figures[group][name] = {
                **Bands.of(sweep[:, 2], on_grid[k].accepted(config)).summary(),
                "settings": config.model_dump(mode="json", exclude={"impact"}),
                "held_out": Bands.of(unseen[:, 2], on_unseen[k].accepted(config)).summary(),
            }
    figures |= _inclination(unseen[:, 2], on_unseen[configs.index(tuned["medium"])])
    figures["robustness"] = [{"variant": name, **_variant(config, few, seed, jobs, count)} for name, config in many]
    figures["targets"] = _targets(figures)
    figures["planar"] = _without_inf(planar.model_dump())
    return figures


def _cpu_s() -> float:
    return sum(os.times()[:4])


def _inclination(beta_deg: Array, seen: Judged) -> Figures:
    """Return how well the turn of the tip in contact tells the inclination, within +-8 deg."""
    rows = (np.abs(beta_deg) <= 8) & np.isfinite(seen.turn_rad)
    error = np.abs(np.degrees(seen.turn_rad[rows]) - beta_deg[rows])
    last = seen.verdict_s[np.isfinite(seen.verdict_s)]
    return {
        "inclination_mae_deg": float(error.mean()),
        "inclination_worst_deg": float(error.max()),
        "inclination_known": float(rows.sum() / (np.abs(beta_deg) <= 8).sum()),
        "verdict_after_first_impact_s": {"median": float(np.median(last)), "largest": float(last.max())},
    }


def _variant(
    planar: PlanarConfig, few: tuple[Array, Array], seed: int, jobs: int, count: Callable[[int], None]
) -> Figures:
    """Tune on the variant, and count on impacts of it that are held out."""
    tried = shapes(planar.impact)
    learn, unseen = few
    seen, found = (judge(part, planar, tried, seed, jobs, count) for part in (learn, unseen))
    sets: Figures = {}
    for name, tolerance in TOLERANCE_DEG.items():
        try:
            config = tune(list(zip(tried, seen, strict=True)), learn[:, 2], tolerance)
        except TactfulError as error:
            sets[name] = {"band_deg": None, "problem": str(error)}
            continue
        k = next(
            i for i, s in enumerate(tried) if (s.a_per_s, s.m_max, s.m_c) == (config.a_per_s, config.m_max, config.m_c)
        )
        bands = Bands.of(unseen[:, 2], found[k].accepted(config))
        sets[name] = bands.summary() | {"accepted_within": bands.within(tolerance)}
    return sets


def _targets(figures: Figures) -> list[Figures]:
    """Compare the figures with what was wanted."""
    rows = []

    def add(what: str, target: str, reached: str, met: bool) -> None:
        rows.append({"what": what, "target": target, "reached": reached, "met": bool(met)})

    for name, B in TOLERANCE_DEG.items():
        for where, found in (("grid", figures["tuned"][name]), ("held out", figures["tuned"][name]["held_out"])):
            band, (low, high) = found["band_deg"], found["ambiguous_deg"]
            held = band is not None and band[0] <= -B and band[1] >= B
            exact = held and (where == "held out" or band == [-B, B])
            most = 2.0 if where == "grid" else 1.5
            add(
                f"+-{B:g} deg, tuned, {where}",
                f"band, <= {most:g} deg ambiguous, none beyond",
                f"{_band(band)}, {low:g} / {high:g} deg, {100 * found['accepted_beyond']:.2g} %",
                exact and max(low, high) <= most and found["accepted_beyond"] == 0,
            )
    add("CPU for the grid", "< 240 s", f"{figures['cpu_s']:.0f} s", figures["cpu_s"] < 240)
    error = figures["inclination_mae_deg"]
    add("inclination, held out", "<= 1 deg", f"{error:.2g} deg", error <= 1)
    rough = next(row for row in figures["robustness"] if row["variant"].startswith("both: contact 0.2 known"))
    for name in ("medium", "wide"):
        B, found = TOLERANCE_DEG[name], rough[name]
        band = found["band_deg"]
        ambiguous = max(found.get("ambiguous_deg", [np.inf]))
        add(
            f"+-{B:g} deg with friction of contact and joints, held out",
            "band, <= 2 deg ambiguous",
            f"{_band(band)}, {ambiguous:g} deg",
            band is not None and band[0] <= -B and band[1] >= B and ambiguous <= 2,
        )
    return rows


def _band(band: list[float] | None) -> str:
    return "none" if band is None else f"[{band[0]:g}, {band[1]:g}]"


def _without_inf(data: Any) -> Any:
    """Replace infinities, which JSON does not know, by text."""
    if isinstance(data, dict):
        return {key: _without_inf(value) for key, value in data.items()}
    if isinstance(data, list | tuple):
        return [_without_inf(value) for value in data]
    return "inf" if isinstance(data, float) and np.isinf(data) else data
