"""One file a source, found by the scheme that an address begins with.

A source module offers `FORM`, how its addresses look, and `create(address, settings)`, which returns a `Source`. Adding
a source is adding a file here.
"""

from __future__ import annotations

import difflib
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from pkgutil import iter_modules

from tactful.live._source import Source, SourceError
from tactful.monitor import MonitorConfig

SCHEMES = tuple(sorted(module.name for module in iter_modules(__path__) if not module.name.startswith("_")))


@dataclass(frozen=True, kw_only=True)
class Settings:
    """What a source may want to know.

    Attributes:
        config: the settings of the monitor, which name the arm.
        react: whether torques are to be commanded.
        speed: robot time that is to pass in a second, where the source can choose; 0 is as fast as it goes.
        mapping: what the columns of a recording mean, a TOML file.
    """

    config: MonitorConfig
    react: bool = False
    speed: float = 1.0
    mapping: Path | None = None


def fill_in(given: MonitorConfig, known: MonitorConfig) -> MonitorConfig:
    """Return the settings that a source knows, with what is given of its arm; those given, if they say more."""
    another = given.robot.model not in (None, known.robot.model)
    if another or given.model_dump(exclude={"robot"}, exclude_defaults=True):
        return given
    arm = {key: getattr(given.robot, key) for key in given.robot.model_fields_set}
    return known.model_copy(update={"robot": known.robot.model_copy(update=arm)})


def open_source(
    address: str,
    config: MonitorConfig | None = None,
    *,
    react: bool = False,
    speed: float = 1.0,
    mapping: Path | None = None,
) -> Source:
    """Return the source of an address, not yet connected.

    Args:
        address: `sim`, `replay:FILE`, `franka://HOST`, `ros2:/TOPIC` or `ur://HOST`.
        config: the settings of the monitor, which name the arm.
        react: whether torques are to be commanded.
        speed: robot time that is to pass in a second, of `sim` and `replay`; 0 is as fast as it goes.
        mapping: what the columns of a recording mean, a TOML file.

    Raises:
        SourceError: if the address is none, or the source takes no torques but has to.
    """
    scheme, _, rest = address.partition(":")
    if scheme not in SCHEMES:
        forms = ", ".join(import_module(f"{__name__}.{name}").FORM for name in SCHEMES)
        near = difflib.get_close_matches(scheme, SCHEMES, n=1)
        hint = f"did you mean {near[0]!r}? " if near else ""
        raise SourceError(address, f"no source is called {scheme!r}: {hint}There are {forms}")
    if not (speed >= 0 and speed < float("inf")):
        raise SourceError(address, f"the speed is {speed}: it is a number from 0 (as fast as it goes) on")
    module = import_module(f"{__name__}.{scheme}")
    settings = Settings(config=config or MonitorConfig(), react=react, speed=speed, mapping=mapping)
    source: Source = module.create(address, rest.removeprefix("//"), settings)
    return source
