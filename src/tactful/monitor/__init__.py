"""The contact monitor: from samples to contacts."""

from tactful.monitor._config import LinkConfig, MonitorConfig, RobotConfig
from tactful.monitor._event import ContactEvent, Location
from tactful.monitor._monitor import Monitor, SampleError
from tactful.monitor._timeline import Health, Timeline

__all__ = [
    "ContactEvent",
    "Health",
    "LinkConfig",
    "Location",
    "Monitor",
    "MonitorConfig",
    "RobotConfig",
    "SampleError",
    "Timeline",
]
