"""External joint torque and wrench from what the robot measures."""

from tactful.estimation._config import ObserverConfig, WrenchConfig
from tactful.estimation._elastic import elastic_torque
from tactful.estimation._momentum_observer import MomentumObserver
from tactful.estimation._wrench import Wrench, external_wrench

__all__ = ["MomentumObserver", "ObserverConfig", "Wrench", "WrenchConfig", "elastic_torque", "external_wrench"]
