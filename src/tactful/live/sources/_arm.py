"""Which arm a source is of, and whether it is there."""

from __future__ import annotations

import socket

from tactful.live._source import SourceError
from tactful.monitor import MonitorConfig
from tactful.robots import Robot

_CONNECT_S = 3.0


def find_arm(source: str, config: MonitorConfig, *, default: str | None, joints: int | None = None) -> Robot:
    """Return the arm that the settings name, or the one that such a source usually has.

    Raises:
        RobotError: if there is no such arm.
        SourceError: if none is known, or it has another number of joints than the source.
    """
    model = config.robot.model or default
    if model is None:
        raise SourceError(source, "which arm is it? Name it: --robot, one of `tactful robots`, or an MJCF or URDF file")
    robot = config.robot.model_copy(update={"model": model}).load()
    assert robot is not None
    if joints is not None and robot.n != joints:
        raise SourceError(source, f"gives {joints} joints, but {robot.name} has {robot.n}: choose its robot")
    return robot


def knock(source: str, host: str, port: int, advice: str) -> None:
    """See within three seconds whether somebody listens: the makers' libraries wait for minutes, or print.

    Raises:
        SourceError: if nobody does.
    """
    try:
        socket.create_connection((host, port), timeout=_CONNECT_S).close()
    except OSError as error:
        reason = "no answer" if isinstance(error, TimeoutError) else error.strerror or str(error)
        raise SourceError(source, f"no arm at {host}, port {port}: {reason}; {advice}") from None
