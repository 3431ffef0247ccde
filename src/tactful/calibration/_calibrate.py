"""From recordings of free motion to the configuration of a monitor."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tactful import __version__
from tactful.calibration._checks import (
    check_contact,
    check_explained,
    check_gravity,
    check_motion,
    not_excited,
    source_of,
)
from tactful.calibration._columns import Columns, columns_of
from tactful.calibration._external import External, quiet_parts, rms, still
from tactful.calibration._fit import Fit, fit
from tactful.calibration._levels import Free, frequency_thresholds, glr_thresholds
from tactful.calibration._motion import HeldOut, Stretch, quietest, stretches_of
from tactful.calibration._noise import FreeTorque, noise_of
from tactful.calibration._threshold import Threshold
from tactful.errors import TactfulError
from tactful.estimation import MomentumObserver, ObserverConfig
from tactful.monitor import LinkConfig, MonitorConfig, RobotConfig
from tactful.recordings import Recording

Array = NDArray[np.float64]

_FOLDS = 4
"""Parts of the motion, each of which is held out once."""
_RELEASE = 4.0
"""How far the torque may be from what it was before a contact that is over, in RMS of the residual."""
_SETTLING_S = 0.3
"""Time after the start of a stretch in which the residual settles and is not counted [s]."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Calibration:
    """What a calibration found.

    Attributes:
        config: the configuration of a monitor of this arm.
        fit: the arm's figures, fitted to all of the motion, with their standard deviations; None where the external
            torque or a wrench was recorded, which the robot's own model is in.
        before_nm: RMS of the residual of the nominal arm (n,) [Nm]; or of the external torque [Nm], or wrench [N, Nm].
        after_nm: RMS of the residual of the calibrated arm, on time that it was not fitted to (n,) [Nm]; or without its
            mean.
        thresholds: of each of the detectors' levels, in the order of `config.fast` and `config.frequency`.
        not_excited: what the motion says nothing about, a sentence each.
        duration_s: how much motion there was [s].
    """

    config: MonitorConfig
    fit: Fit | None
    before_nm: Array
    after_nm: Array
    thresholds: dict[str, tuple[Threshold, ...]]
    not_excited: tuple[str, ...]
    duration_s: float

    def save(self, path: str | Path) -> None:
        """Write the configuration to a TOML file, which `MonitorConfig.load` reads.

        Raises:
            ConfigError: if it cannot be written.
        """
        self.config.save(path)


def calibrate(
    recordings: Sequence[Recording],
    config: MonitorConfig,
    *,
    payload: tuple[float, ArrayLike] | None = None,
    false_alarms_per_hour: float = 0.125,
) -> Calibration:
    """Calibrate an arm from motion in which nothing touches it.

    With the measured torque, the inertial figures of the links, close to the nominal ones and physically consistent,
    the payload, bias and friction come from one fit to the residual of the observer. What is left of it on held-out
    time (each quarter under the fit to the others) gives the noise and the thresholds. With the robot's own external
    torque alone, or a wrench, there is nothing to fit: their noise and the thresholds are found.

    Args:
        recordings: the motion, all of one rate: q, dq and tau, or tau_ext with q, or a wrench; the first of these that
            is there, or what `config.source` says.
        config: names the arm, and its tip and gravity; other settings are kept where they are not calibrated.
        payload: mass [kg] and centre of mass in the tip frame (3,) [m] of the payload; None finds it.
        false_alarms_per_hour: what the thresholds are for [1/h].

    Raises:
        CalibrationError: if the recordings do not fit the arm, are too short, at a standstill, or hold contact.
        TactfulError: if the configuration names no arm, or the rate of false alarms is not positive.
    """
    if not recordings:
        raise TactfulError("there is nothing to calibrate from: pass one recording or more")
    source = source_of(recordings, config)
    if source != "tau":
        return _from_external(recordings, config, source, false_alarms_per_hour)
    bare = config.robot.model_copy(update={"payload_kg": 0.0, "payload_com_m": (0.0, 0.0, 0.0)}).load()
    if bare is None:
        raise TactfulError("which arm was recorded? Name it in config.robot.model")
    known = None if payload is None else (float(payload[0]), np.asarray(payload[1], dtype=np.float64))
    robot = bare.with_payload(*known) if known and known[0] else bare
    name = recordings[0].source or "recording"
    stretches = stretches_of(recordings, robot)
    check_motion(stretches, name)
    check_gravity(stretches, robot, name)
    config = config.fitted_to(recordings[0].rate_hz)
    rate_hz = config.rate_hz
    observer = quietest(stretches, robot, config.observer, rate_hz)

    columns = columns_of(stretches, robot, observer)
    found = fit(columns, bare, known)
    check_contact(columns, found, stretches)
    check_explained(found, stretches, bare, name)

    held_out = _held_out(stretches, columns, found, observer)
    before = _rms([HeldOut(stretch, 0, len(stretch), robot, observer) for stretch in stretches])
    after = _rms(held_out)

    noise = noise_of([FreeTorque.of(part, config.fast, rate_hz) for part in held_out], config.fast, rate_hz)
    update = {
        "noise": noise,
        "observer": found.observer(observer),
        "source": source,
        "robot": _robot_config(config.robot, found),
    }
    provenance = {
        "robot": bare.title,
        "bias_sd_nm": _listed(found.sd["bias"]),
        "coulomb_sd_nm": _listed(found.sd["coulomb"]),
        "viscous_sd_nms": _listed(found.sd["viscous"]),
    }
    return _with_thresholds(
        config.model_copy(update=update),
        held_out,
        false_alarms_per_hour,
        recordings,
        provenance,
        fit=found,
        before_nm=before,
        after_nm=after,
        not_excited=not_excited(stretches, robot),
        duration_s=sum(stretch.duration_s for stretch in stretches),
    )


def _from_external(
    recordings: Sequence[Recording], config: MonitorConfig, source: External, false_alarms_per_hour: float
) -> Calibration:
    """Calibrate from the robot's own external torque, or a wrench."""
    robot = config.robot.load() if source == "tau_ext" else None
    if source == "wrench":
        config = config.model_copy(update={"robot": RobotConfig()})
    config = config.fitted_to(recordings[0].rate_hz)
    parts = quiet_parts(recordings, robot, config.observer, source)
    noise = noise_of([part.torque(source) for part in parts], config.fast, config.rate_hz)
    mean, after = rms(parts, source)
    return _with_thresholds(
        config.model_copy(update={"noise": noise, "source": source}),
        parts,
        false_alarms_per_hour,
        recordings,
        {"robot": robot.title if robot else "", "mean": _listed(mean)},
        fit=None,
        before_nm=np.hypot(mean, after),
        after_nm=after,
        not_excited=still(parts),
        duration_s=sum(part.recording.duration_s for part in parts),
    )


def _with_thresholds(
    config: MonitorConfig,
    parts: Sequence[Free],
    false_alarms_per_hour: float,
    recordings: Sequence[Recording],
    provenance: dict[str, Any],
    **found: Any,
) -> Calibration:
    """Return the calibration with the thresholds that follow from time without contact, and where it comes from."""
    thresholds = {
        "fast": glr_thresholds(parts, config, false_alarms_per_hour),
        "frequency": frequency_thresholds(parts, config, false_alarms_per_hour),
    }
    values = {key: tuple(float(f"{item.value:.4g}") for item in items) for key, items in thresholds.items()}
    release = _release(config, found["after_nm"])
    update = {
        "fast": config.fast.model_copy(update={"threshold": values["fast"], "release": release}),
        "frequency": config.frequency.model_copy(update={"threshold_n": values["frequency"]}),
        "provenance": {
            "made_by": f"tactful {__version__} calibrate",
            "made_on": datetime.now(UTC).date().isoformat(),
            "recordings": [recording.source for recording in recordings],
            "duration_s": round(found["duration_s"], 3),
            "residual_before_nm": _listed(found["before_nm"]),
            "residual_after_nm": _listed(found["after_nm"]),
            "false_alarms_per_hour": false_alarms_per_hour,
            "threshold": thresholds["fast"][0].statement,
            "not_excited": list(found["not_excited"]),
            **provenance,
        },
    }
    return Calibration(config=config.model_copy(update=update), thresholds=thresholds, **found)


def _release(config: MonitorConfig, after: Array) -> tuple[float, ...]:
    """Return from when on a contact is over (n,) [model_nm]: the torque changes in free motion, too."""
    model = config.noise.resolved("model_nm", np.ones_like(after))
    return tuple(float(f"{value:.4g}") for value in np.maximum(config.fast.release, _RELEASE * after / model))


def _held_out(stretches: Sequence[Stretch], columns: Columns, found: Fit, observer: ObserverConfig) -> list[HeldOut]:
    """Return each fold of the motion with the arm that was fitted to the others."""
    ends = [np.linspace(0, len(stretch), _FOLDS + 1).astype(int) for stretch in stretches]
    parts = []
    for fold in range(_FOLDS):
        out = np.zeros(len(columns.t), dtype=bool)
        for number, stretch in enumerate(stretches):
            start, stop = ends[number][fold : fold + 2]
            out |= (columns.stretch == number) & (columns.t >= stretch.t[start]) & (columns.t <= stretch.t[stop - 1])
        others = found.of(~out)
        parts += [
            HeldOut(
                stretch, int(ends[number][fold]), int(ends[number][fold + 1]), others.robot, others.observer(observer)
            )
            for number, stretch in enumerate(stretches)
        ]
    return parts


def _rms(parts: Sequence[HeldOut]) -> Array:
    """Return the RMS of the residual (n,) [Nm]."""
    residuals = []
    for part in parts:
        stretch = part.stretch
        r = MomentumObserver(part.robot, part.observer).run(stretch.t, stretch.q, stretch.dq, stretch.tau)
        residuals.append(r[part.counts(_SETTLING_S)])
    return np.sqrt(np.mean(np.concatenate(residuals) ** 2, axis=0))  # type: ignore[no-any-return]


def _robot_config(config: RobotConfig, found: Fit) -> RobotConfig:
    links = found.links
    rows = tuple(
        LinkConfig(
            mass_kg=float(f"{links.mass[i]:.9g}"),
            com_m=tuple(float(f"{x:.9g}") for x in links.com[i]),
            inertia_kg_m2=tuple(float(f"{x:.9g}") for x in links.inertia[i][np.triu_indices(3)]),
        )
        for i in range(links.n)
    )
    update: dict[str, Any] = {
        "links": rows,
        "payload_kg": float(f"{found.payload_kg:.6g}"),
        "payload_com_m": tuple(float(f"{x:.6g}") for x in found.payload_com_m),
    }
    if links.torque_sensor == "motor":
        update["motor_inertia_kg_m2"] = tuple(float(f"{x:.6g}") for x in links.motor_inertia)
    return config.model_copy(update=update)


def _listed(values: Array) -> list[float]:
    return [float(f"{value:.3g}") for value in values]
