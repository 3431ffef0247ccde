"""Robot arms as data: built in, or from any MJCF or URDF file."""

from tactful.robots._errors import RobotError, RobotFileError, UnknownFrameError, UnknownRobotError
from tactful.robots._geometry import Capsule, Frame
from tactful.robots._robot import Robot

__all__ = ["Capsule", "Frame", "Robot", "RobotError", "RobotFileError", "UnknownFrameError", "UnknownRobotError"]
