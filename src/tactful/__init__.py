"""Contact monitoring for robot arms.

`Robot` is an arm as data, `Recording` what its sensors said, and `Monitor` tells from both that the arm is touched:
`Monitor.update` one sample at a time, `Monitor.run` over a recording. Each public name is imported on first use, so
that `import tactful` costs nothing.
"""

from importlib import import_module
from typing import TYPE_CHECKING

from tactful.errors import TactfulError

if TYPE_CHECKING:
    from tactful.monitor import ContactEvent, Monitor, MonitorConfig, Timeline
    from tactful.recordings import Label, Recording
    from tactful.robots import Robot

__version__ = "0.1.0"

__all__ = [
    "ContactEvent",
    "Label",
    "Monitor",
    "MonitorConfig",
    "Recording",
    "Robot",
    "TactfulError",
    "Timeline",
]

_HOME = {
    "ContactEvent": "tactful.monitor",
    "Label": "tactful.recordings",
    "Monitor": "tactful.monitor",
    "MonitorConfig": "tactful.monitor",
    "Recording": "tactful.recordings",
    "Robot": "tactful.robots",
    "Timeline": "tactful.monitor",
}


def __getattr__(name: str) -> object:
    """Import a public name from its package on first use (PEP 562)."""
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value: object = getattr(import_module(_HOME[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
