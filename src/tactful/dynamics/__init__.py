"""Rigid-body dynamics in the momentum form."""

from tactful.dynamics._arm import Record, arm_record, motion_record
from tactful.dynamics._dynamics import Dynamics

__all__ = ["Dynamics", "Record", "arm_record", "motion_record"]
