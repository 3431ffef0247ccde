"""Where on the arm is a contact, and how hard: isolation and identification on simulated contacts."""

from tactful.studies.isolation._draw import Contact, Draw
from tactful.studies.isolation._study import isolation_study

__all__ = ["Contact", "Draw", "isolation_study"]
