"""The impacts of the study, and what may differ from the assumed arm."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from tactful.control import ImpactControlConfig
from tactful.detection import ImpactConfig
from tactful.impacts import CompliantContactConfig
from tactful.simulation.planar import ArmConfig, PlanarConfig, SensorsConfig, TaskConfig
from tactful.studies.aim_aware._evidence import cases

Array = NDArray[np.float64]
Grid = Literal["paper", "fine"]

STEP_DEG: Mapping[str, float] = {"paper": 1.0, "fine": 0.25}
XI_S = 0.095
"""Time from the last impact to the verdict of the tuned sets: the verdict is there within 100 ms."""
FRICTION = "both: contact 0.2 known, joints as calibrated"
"""The variant for which there is a target."""


def paper_grid(grid: Grid) -> Array:
    """Return the impacts of the paper's sweep (k, 3); "fine" has its inclinations every 0.25 deg."""
    beta = np.arange(-10.0, 10.01, STEP_DEG[grid])
    return cases(np.arange(60.0, 120.1, 2.0), 0.2 + 0.02 * np.arange(11), beta)


def training(step_deg: float, alphas: int, places: int) -> Array:
    """Return impacts to tune on (k, 3), on the corners of the paper's sweep and between; every 1 deg beyond +-6."""
    fine: Array = np.arange(-6.0, 6.0 + 1e-6, step_deg, dtype=np.float64)
    beta = np.concatenate([np.arange(-10.0, -6.0), fine, np.arange(7.0, 10.1)])
    return cases(np.linspace(60, 120, alphas), np.linspace(0.2, 0.4, places), beta)


def held_out(step_deg: float, alphas: int, places: int) -> Array:
    """Return impacts of approaches and places that nothing was tuned on (k, 3)."""
    beta = np.arange(-10.0, 10.0 + 1e-6, step_deg)
    return cases(np.linspace(63, 117, alphas), np.linspace(0.21, 0.39, places), beta)


@dataclass(frozen=True)
class Variant:
    """Something that differs from the assumed arm.

    Attributes:
        name: what.
        planar: the whole configuration.
        place_r_b: whether the classifier's r_b is tuned, or is the controller's.
        xi_s: time from the last impact to the verdict [s].
    """

    name: str
    planar: PlanarConfig
    place_r_b: bool = True
    xi_s: float = XI_S


def variants(base: PlanarConfig) -> Iterator[Variant]:
    """Yield what the robustness is measured on."""

    def change(**parts: Any) -> PlanarConfig:
        return base.model_copy(update=parts)

    def r_b(value: float) -> ImpactConfig:
        return base.impact.model_copy(update={"r_b_nm_s": (value, value, inf)})

    inf = float("inf")
    bandpass = base.impact.model_copy(update={"r_b_nm_s": (inf, 1350.0, inf), "bandpass_hz": 30.0})
    small = ArmConfig(half_width_m=0.05)
    rough = CompliantContactConfig(friction=0.2)
    knows = {"task": TaskConfig(friction=0.2), "control": ImpactControlConfig(friction=0.2)}
    loose = ArmConfig(coulomb_nm=(1.0,) * 3, viscous_nms=(1.0,) * 3)
    calibrated = ArmConfig(coulomb_nm=(0.1,) * 3, viscous_nms=(0.1,) * 3)
    noisy, noisier, noisiest = (
        SensorsConfig(encoder_noise_rad=angle, torque_noise_nm=torque, velocity_cutoff_hz=cutoff)
        for angle, torque, cutoff in ((1e-5, 0.05, 100.0), (2e-5, 0.2, 30.0), (5e-5, 0.2, 100.0))
    )
    yield Variant("as assumed", base)
    yield Variant("torque 1 ms late", change(control=ImpactControlConfig(delay_samples=1)))
    yield Variant("encoder 1e-5 rad, torque 0.05 Nm, dq behind 100 Hz", change(sensors=noisy, impact=r_b(3000.0)))
    yield Variant("encoder 2e-5 rad, torque 0.2 Nm, dq behind 30 Hz", change(sensors=noisier, impact=r_b(1900.0)))
    yield Variant("encoder 5e-5 rad, torque 0.2 Nm, dq behind 100 Hz", change(sensors=noisiest, impact=r_b(8000.0)))
    yield Variant("the same, band-pass observer to 30 Hz", change(sensors=noisiest, impact=bandpass))
    yield Variant("contact ten times softer", change(contact=CompliantContactConfig(stiffness=2e6)))
    yield Variant("restitution 0.3", change(contact=CompliantContactConfig(restitution=0.3)))
    yield Variant("half-width 0.05 m", change(arm=small))
    yield Variant("half-width 0.05 m, verdict after 0.2 s", change(arm=small), xi_s=0.2)
    pressed = ImpactControlConfig(normal_force_n=-160.0)
    yield Variant("half-width 0.05 m, pressed with 160 N", change(arm=small, control=pressed))
    yield Variant("r_b 1000 Nm/s", change(impact=r_b(1000.0)), place_r_b=False)
    yield Variant("r_b 4000 Nm/s", change(impact=r_b(4000.0)), place_r_b=False)
    yield Variant("joint friction 1 Nm + 1 Nms/rad", change(arm=loose))
    yield Variant("joint friction 0.1 Nm + 0.1 Nms/rad, as calibrated", change(arm=calibrated))
    yield Variant("contact friction 0.2, unknown", change(contact=rough))
    yield Variant("contact friction 0.2, known to the map", change(contact=rough, **knows))
    yield Variant(FRICTION, change(contact=rough, arm=calibrated, **knows))
    yield Variant("both: contact 0.2 unknown, joints 1 + 1", change(contact=rough, arm=loose))
