"""The configuration of a monitor."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any, Literal, Self

import numpy as np
from pydantic import Field

from tactful.classification import (
    AimAwareConfig,
    KinestheticClassifier,
    KinestheticConfig,
    LearnedClassifier,
    LearnedConfig,
)
from tactful.config import Config, ConfigError
from tactful.detection import ContactConfig, FastConfig, FrequencyConfig, NoiseConfig
from tactful.estimation import ObserverConfig, WrenchConfig
from tactful.isolation import IsolationConfig
from tactful.robots import Robot
from tactful.signals import largest_band_hz

Source = Literal["tau", "tau_ext", "wrench"]
_RULES, _LEARNED = "kinesthetic", "learned"


class LinkConfig(Config):
    """The inertial figures of a link, in its frame."""

    mass_kg: Annotated[float, Field(gt=0)]
    com_m: tuple[float, float, float]
    inertia_kg_m2: tuple[float, float, float, float, float, float]
    """About the centre of mass: xx, xy, xz, yy, yz, zz."""


class RobotConfig(Config):
    """The arm, for a monitor that is given none."""

    model: str | None = None
    """Name of a built-in arm, or path of an MJCF or URDF file; None for recordings of a wrench alone."""
    tip: str | None = None
    """Frame at which the force is estimated; None takes the model's default."""
    gravity_m_s2: tuple[float, float, float] | None = None
    """Gravity in the base frame, for an arm on a wall or a ceiling; None takes the model's [m/s^2]."""
    payload_kg: Annotated[float, Field(ge=0)] = 0.0
    """Mass of a tool or a load at the tip [kg]."""
    payload_com_m: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Its centre of mass in the tip frame [m]."""
    links: tuple[LinkConfig, ...] = ()
    """Inertial figures that replace the model's, one entry a link, as a calibration finds them; none keeps those."""
    motor_inertia_kg_m2: tuple[Annotated[float, Field(ge=0)], ...] = ()
    """Motor inertias, reflected to the links, that replace the model's; none keeps those [kg m^2]."""

    def load(self) -> Robot | None:
        """Return the arm as it is mounted and loaded, or None without a model.

        Raises:
            RobotError: if there is no such model or frame, or a figure cannot be physical.
            ConfigError: if there are not as many figures as links.
        """
        if self.model is None:
            return None
        robot = Robot.load(self.model, tip=self.tip)
        if self.gravity_m_s2 is not None:
            robot = robot.with_gravity(self.gravity_m_s2)
        robot = replace(robot, **self._figures(robot))
        return robot.with_payload(self.payload_kg, self.payload_com_m) if self.payload_kg else robot

    def _figures(self, robot: Robot) -> dict[str, Any]:
        """Return the fields of the robot that are replaced."""
        for key in ("links", "motor_inertia_kg_m2"):
            if (count := len(getattr(self, key))) not in (0, robot.n):
                raise ConfigError("robot", key, f"has {count} entries, but {robot.name} has {robot.n} links")
        figures: dict[str, Any] = {}
        if self.links:
            figures["mass"] = np.array([link.mass_kg for link in self.links])
            figures["com"] = np.array([link.com_m for link in self.links])
            inertia = np.array([link.inertia_kg_m2 for link in self.links])  # (n, 6)
            figures["inertia"] = inertia[:, [0, 1, 2, 1, 3, 4, 2, 4, 5]].reshape(-1, 3, 3)
        if self.motor_inertia_kg_m2:
            figures["motor_inertia"] = np.array(self.motor_inertia_kg_m2)
        return figures


class MonitorConfig(Config):
    """Everything that a monitor can be told. Frozen; stored with every result.

    Example:
        >>> MonitorConfig(frequency={"threshold_n": 1.5}).frequency.threshold_n
        1.5
    """

    rate_hz: Annotated[float, Field(gt=0)] = 1000.0
    """Nominal sampling rate [Hz]. Time stamps may jitter; windows count samples."""
    source: Literal["auto", "tau", "tau_ext", "wrench"] = "auto"
    """What the force is estimated from: measured joint torque, the robot's own external torque, or a wrench; "auto"
    takes the first of them that is there."""
    mode: Literal["fast", "paper"] = "fast"
    """The detector: "fast" looks at the external torque over windows of 5 to 160 ms, against the noise of the arm;
    "paper" at the frequency content of the external force, as Salt Ducaju et al. 2022 do."""
    robot: RobotConfig = RobotConfig()
    observer: ObserverConfig = ObserverConfig()
    wrench: WrenchConfig = WrenchConfig()
    fast: FastConfig = FastConfig()
    noise: NoiseConfig = NoiseConfig()
    frequency: FrequencyConfig = FrequencyConfig()
    contact: ContactConfig = ContactConfig()
    classifier: str = _LEARNED
    """What tells the kind of a contact: "learned", the model that is part of Tactful, "kinesthetic", the rules of the
    paper, or the file of a model that `tactful train` wrote; its path is relative to the file of the configuration. The
    rules also tell what a model cannot: all contacts in paper mode, and those where only a wrench is known."""
    isolation: IsolationConfig = IsolationConfig()
    kinesthetic: KinestheticConfig = KinestheticConfig()
    learned: LearnedConfig = LearnedConfig()
    aim_aware: AimAwareConfig = AimAwareConfig()
    provenance: dict[str, Any] = Field(default_factory=dict)
    """Where the settings come from, as `tactful calibrate` writes it; nothing depends on it."""

    @classmethod
    def load(cls, path: str | Path) -> Self:
        """Return the configuration that a TOML file holds; what it does not name has its default.

        Raises:
            ConfigError: if the file cannot be read, is not TOML, or has an unknown key or a value that is not allowed.
        """
        config = cls.from_toml(path)
        if config.classifier_file is None:
            return config
        return config.model_copy(update={"classifier": str(Path(path).parent / config.classifier_file)})

    def save(self, path: str | Path) -> None:
        """Write what differs from the defaults to a TOML file, which `load` reads, all at once or not at all.

        Raises:
            ConfigError: if it cannot be written.
        """
        import tomli_w

        file = Path(path)
        partial = file.with_name(file.name + ".partial")
        try:
            text = tomli_w.dumps(self.model_dump(mode="json", exclude_defaults=True, exclude_none=True))
            partial.write_text(text, encoding="utf-8")
            partial.replace(file)
        except OSError as error:
            raise ConfigError(str(file), "", f"cannot be written: {error.strerror or error}") from None
        finally:
            partial.unlink(missing_ok=True)

    @property
    def classifier_file(self) -> str | None:
        """The file that `classifier` names; None for those that are part of Tactful."""
        return None if self.classifier in (_LEARNED, _RULES) else self.classifier

    def load_classifier(self) -> KinestheticClassifier | LearnedClassifier:
        """Return what `classifier` names.

        Raises:
            ConfigError: if it names no file.
            ModelError: if the file is no classifier.
        """
        rules = KinestheticClassifier(self.kinesthetic)
        if self.classifier == _RULES:
            return rules
        file = self.classifier_file
        if file is not None and not Path(file).is_file():
            problem = f"there is no file {file!r}: give the path of a model, {_LEARNED!r} or {_RULES!r}"
            raise ConfigError("monitor", "classifier", problem, file)
        return LearnedClassifier(file, self.learned, otherwise=rules)

    def fitted_to(self, rate_hz: float) -> Self:
        """Return this configuration for another sampling rate; within 5 % it stays what it is.

        A window and a band that were set stay as they are. Left at their defaults, they become what the rate carries of
        them: a window of half a second and the band 10-100 Hz or, below 200 Hz, all that the rate carries.
        """
        if abs(rate_hz / self.rate_hz - 1) <= 0.05:
            return self
        frequency = self.frequency
        if not {"window", "band_hz"} & frequency.model_fields_set:
            window = max(2, round(0.5 * rate_hz))
            low, high = largest_band_hz(rate_hz, window)
            band = (10.0, 100.0) if high >= 100 else (low, high)
            frequency = frequency.model_copy(update={"window": window, "band_hz": band})
        aim_aware = self.aim_aware.fitted_to(rate_hz, from_hz=self.rate_hz)
        return self.model_copy(update={"rate_hz": rate_hz, "frequency": frequency, "aim_aware": aim_aware})
