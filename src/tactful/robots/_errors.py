"""What can be wrong with a robot, its file or the names in it."""

from __future__ import annotations

import difflib
from collections.abc import Iterable
from pathlib import Path

from tactful.errors import TactfulError


class RobotError(TactfulError):
    """A robot whose figures contradict each other or cannot be physical.

    Attributes:
        robot: Name of the robot.
        field: The field of `Robot` at fault.
    """

    def __init__(self, robot: str, field: str, problem: str) -> None:
        """Name the robot, the field and what is wrong with it."""
        super().__init__(f"robot {robot!r}: {field} {problem}")
        self.robot = robot
        self.field = field


class UnknownRobotError(TactfulError):
    """A name that is neither built in nor the path of a robot file.

    Attributes:
        name: What was asked for.
        known: The names that are built in.
    """

    def __init__(self, name: str, known: Iterable[str]) -> None:
        """List the built-in robots and suggest the nearest."""
        self.name = name
        self.known = tuple(known)
        super().__init__(
            f"no robot is called {name!r}{_nearest(name, self.known)}; built in: {', '.join(self.known)};"
            " any other arm loads from an MJCF (.xml, .mjcf) or URDF (.urdf) file"
        )


class UnknownFrameError(TactfulError):
    """A frame (site or link) that the robot does not have.

    Attributes:
        robot: Name of the robot.
        frame: What was asked for.
        known: The frames that there are.
    """

    def __init__(self, robot: str, frame: str, known: Iterable[str]) -> None:
        """List the frames and suggest the nearest."""
        self.robot = robot
        self.frame = frame
        self.known = tuple(known)
        listed = ", ".join(self.known[:30]) + (f" and {len(self.known) - 30} more" if len(self.known) > 30 else "")
        super().__init__(f"robot {robot!r} has no frame {frame!r}{_nearest(frame, self.known)}; it has: {listed}")


class RobotFileError(TactfulError):
    """A robot file that cannot be read as a serial arm.

    Attributes:
        path: The file.
        problem: What is wrong with it, in one line.
    """

    def __init__(self, path: str | Path, problem: str) -> None:
        """Name the file and what is wrong with it."""
        self.path = Path(path)
        self.problem = " ".join(problem.split())
        super().__init__(f"{path}: {self.problem}")


def _nearest(name: str, known: Iterable[str]) -> str:
    matches = difflib.get_close_matches(name.lower(), list(known), n=1)
    return f", did you mean {matches[0]!r}?" if matches else ""
