"""Where on the arm a contact is, and how hard."""

from tactful.isolation._bias import BiasTracker
from tactful.isolation._config import IsolationConfig
from tactful.isolation._isolator import Isolator
from tactful.isolation._location import ContactLocation, IsolationError, KnownContact, Region, region_of
from tactful.isolation._wrench import WrenchEstimate, WrenchPrior, identify_wrench

__all__ = [
    "BiasTracker",
    "ContactLocation",
    "IsolationConfig",
    "IsolationError",
    "Isolator",
    "KnownContact",
    "Region",
    "WrenchEstimate",
    "WrenchPrior",
    "identify_wrench",
    "region_of",
]
