"""Collision or cooperation: the experiment of the kinesthetic paper in simulation, and what does better."""

from tactful.studies.kinesthetic._study import kinesthetic_study

__all__ = ["kinesthetic_study"]
