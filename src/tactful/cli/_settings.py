"""The settings that most verbs take: a file, and what the command line says beside it."""

from pathlib import Path
from typing import TYPE_CHECKING, Literal

if TYPE_CHECKING:
    from tactful.monitor import MonitorConfig

Mode = Literal["fast", "paper"]


def load_settings(
    config: Path | None, *, robot: str | None = None, tip: str | None = None, mode: Mode | None = None
) -> "MonitorConfig":
    """Return the settings of a file, or the defaults, with what is named beside them.

    Raises:
        ConfigError: if the file cannot be read or has an unknown key or a value that is not allowed.
    """
    from tactful.monitor import MonitorConfig

    settings = MonitorConfig() if config is None else MonitorConfig.load(config)
    named = {key: value for key, value in (("model", robot), ("tip", tip)) if value is not None}
    changes: dict[str, object] = {"robot": settings.robot.model_copy(update=named)}
    if mode is not None:
        changes["mode"] = mode
    return settings.model_copy(update=changes)
