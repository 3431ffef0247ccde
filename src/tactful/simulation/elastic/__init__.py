"""Any serial arm with elastic joints, and the compliant contacts of its points with a plane."""

from tactful.simulation.elastic._arm import ElasticArm, Plane

__all__ = ["ElasticArm", "Plane"]
