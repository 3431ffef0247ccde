"""Where on the arm is a contact, and how hard: isolation and identification on simulated contacts."""

from tactful.studies.isolation._study import isolation_study

__all__ = ["isolation_study"]
