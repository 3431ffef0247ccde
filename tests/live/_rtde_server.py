"""A Universal Robots controller's RTDE on loopback, with an arm that stands still and may be pushed.

Run as a program. It sends packets by itself until the first byte comes on its standard input; from then on one for each
byte, so that a test is in step with it. It ends with its input. Source of the protocol: Universal Robots, "Real-Time
Data Exchange (RTDE) Guide".
"""

from __future__ import annotations

import json
import os
import select
import socket
import struct
import sys
import time
from typing import Any

import numpy as np

from tactful import Robot
from tactful.control import minimum_jerk
from tactful.dynamics import Dynamics
from tests.live._realtime import run_in_real_time
from tests.live._scenes import Scene

PORT = 30004
PERIOD_S = 0.002
NM_A = np.array([10.0, 10.7, 8.46, 9.0, 9.48, 10.1])
_PUSH_S, _RISE_S = 0.5, 0.1
_VERSION, _CONTROLLER, _OUTPUTS, _START, _PAUSE, _DATA = 86, 118, 79, 83, 80, 85
_TYPES = {
    "timestamp": ("DOUBLE", "d"),
    "actual_q": ("VECTOR6D", "6d"),
    "actual_qd": ("VECTOR6D", "6d"),
    "actual_current": ("VECTOR6D", "6d"),
    "robot_mode": ("INT32", "i"),
    "safety_mode": ("INT32", "i"),
    "runtime_state": ("UINT32", "I"),
    "robot_status_bits": ("UINT32", "I"),
    "safety_status_bits": ("UINT32", "I"),
}


class Controller:
    """An arm that stands still under gravity while a hand may push, and what its controller says of it."""

    def __init__(self, scene: Scene) -> None:
        self.arm = Robot.load("ur5e")
        self.hand_s = scene.hand_s
        dynamics = Dynamics(self.arm)
        self.gravity = dynamics.gravity(self.arm.home)
        self.push = dynamics.jacobian(self.arm.home)[:3].T @ np.array([0.0, 60.0, 0.0])  # (6,)
        self.rng = np.random.default_rng(0)
        self.t = 100.0
        self.touch_s: float | None = None

    def values(self, granted: int) -> dict[str, Any]:
        """Go on by a period and return what is sent; time to the hand is counted in granted packets."""
        self.t += PERIOD_S
        tau = self.gravity + 0.05 * self.rng.standard_normal(6)
        if self.hand_s is not None and 0 <= granted * PERIOD_S - self.hand_s < _PUSH_S:
            self.touch_s = self.touch_s or self.t
            tau -= minimum_jerk((granted * PERIOD_S - self.hand_s) / _RISE_S) * self.push
        return {
            "timestamp": self.t,
            "actual_q": self.arm.home,
            "actual_qd": np.zeros(6),
            "actual_current": tau / NM_A,
            "robot_mode": 7,
            "safety_mode": 1,
            "runtime_state": 1,
            "robot_status_bits": 3,
            "safety_status_bits": 1,
        }


class Client:
    """One connection."""

    def __init__(self, connection: socket.socket) -> None:
        self.connection = connection
        self.names: list[str] = []
        self.started = False

    def handle(self) -> bool:
        """Answer a packet; return whether there was one."""
        head = self._exactly(3)
        if head is None:
            return False
        size, kind = struct.unpack(">HB", head)
        body = self._exactly(size - 3) or b""
        if kind == _VERSION:
            self._send(kind, b"\x01")
        elif kind == _CONTROLLER:
            self._send(kind, struct.pack(">4I", 5, 12, 0, 0))
        elif kind == _OUTPUTS:
            self.names = [name for name in body[8:].decode().split(",") if name]
            self._send(kind, b"\x01" + ",".join(_TYPES[name][0] for name in self.names).encode())
        elif kind in (_START, _PAUSE):
            self._send(kind, b"\x01")
            time.sleep(0.05)  # the client drops the answer if data comes along with it
            self.started = kind == _START
        return True

    def send(self, values: dict[str, Any]) -> None:
        """Send a data packet."""
        parts = [b"\x01"]
        for name in self.names:
            form = _TYPES[name][1]
            value = values[name]
            parts.append(struct.pack(">" + form, *(value if form == "6d" else (value,))))
        self._send(_DATA, b"".join(parts))

    def _send(self, kind: int, body: bytes) -> None:
        self.connection.sendall(struct.pack(">HB", len(body) + 3, kind) + body)

    def _exactly(self, count: int) -> bytes | None:
        data = b""
        while len(data) < count:
            part = self.connection.recv(count - len(data))
            if not part:
                return None
            data += part
        return data


def serve(host: str, scene: Scene) -> None:
    """Serve until the standard input ends."""
    run_in_real_time()
    controller = Controller(scene)
    client: Client | None = None
    credit = granted = 0
    free, in_step = True, False
    with socket.create_server((host, PORT)) as server:
        print(json.dumps({"ready": host}), flush=True)
        while True:
            watched: list[Any] = [sys.stdin, server, *([client.connection] if client else [])]
            ready = select.select(watched, [], [], 0 if credit else PERIOD_S if free else 0.2)[0]
            if sys.stdin in ready:
                got = os.read(sys.stdin.fileno(), 4096)
                if not got:
                    break
                credit, free = credit + len(got), False
            if server in ready:
                client = Client(server.accept()[0])
            elif client is not None and client.connection in ready:
                try:
                    alive = client.handle()
                except OSError:
                    alive = False
                if not alive:
                    client = None
            if client is not None and client.started and (credit or free):
                granted += credit > 0
                credit = max(0, credit - 1)
                try:
                    client.send(controller.values(granted))
                except OSError:
                    client = None
                if granted and not in_step:
                    in_step = True
                    print(json.dumps({"in_step": controller.t}), flush=True)
        if client is not None:
            client.connection.close()
    print(json.dumps({"touch_s": controller.touch_s}), flush=True)


if __name__ == "__main__":
    serve(sys.argv[1], Scene(**json.loads(sys.argv[2])))
