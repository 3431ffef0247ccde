"""A Franka arm on loopback: franky-sim's server, before our work cell, so that torques, contacts and gravity are true.

Run as a program (the client's library keeps the interpreter while it waits, so the server needs a process of its own).
It speaks libfranka's protocol on the address that it is given. While a client connects, it sends states by itself; from
the first byte on its standard input on, one for each byte, and in a motion, one for each torque: so a test is in step
with it however slow the machine is. It ends with its input, and then prints what really happened.
"""

from __future__ import annotations

import json
import os
import select
import sys
import time
from typing import Any

import numpy as np
from franky_sim import BaseRobot, FrankaRobotServer
from franky_sim.base_simulator import InnerRobotState
from franky_sim.franka_robot_state import FrankaRobotState

from tactful import Robot
from tactful.dynamics import Dynamics
from tactful.simulation import Box, CellConfig, Push, WorkCell
from tests.live._realtime import run_in_real_time
from tests.live._scenes import Scene

_HELD = np.array([600.0, 600.0, 600.0, 600.0, 250.0, 150.0, 50.0])  # [Nm/rad]
_DAMPED = np.array([50.0, 50.0, 50.0, 50.0, 30.0, 25.0, 15.0])  # [Nms/rad]
_HANDSHAKE_S, _STARVED_S = 0.02, 10.0
"""After this time without an answer a state is sent all the same: while a client connects, and later [s]."""


class CellRobot(BaseRobot):  # type: ignore[misc]
    """The arm in the cell, as franky-sim wants it."""

    def __init__(self, cell: WorkCell) -> None:
        super().__init__(has_gripper=False)
        self.cell = cell
        self.command = np.zeros(7)
        self.sample = cell.step(self.command)

    def _get_state(self) -> InnerRobotState:
        return InnerRobotState(tuple(self.sample.q), tuple(self.sample.dq), tuple(self.sample.tau))

    @property
    def state(self) -> FrankaRobotState:
        """What the sensors say, with libfranka's sign of the external torque."""
        sample = self.sample
        return FrankaRobotState(
            q=tuple(sample.q),
            q_d=tuple(sample.q),
            dq=tuple(sample.dq),
            tau_J=tuple(sample.tau),
            tau_J_d=tuple(self.command),
            tau_ext_hat_filtered=tuple(-self.cell.tau_ext),
            control_command_success_rate=1.0,
        )

    def torque_control(self, torques: Any, has_new_command: bool = True) -> None:
        """Take a torque; the cell compensates gravity itself."""
        self.command = np.clip(torques, -self.cell.robot.torque_limit, self.cell.robot.torque_limit)

    def joint_position_control(self, target_q: Any, has_new_command: bool = True) -> None:
        """Hold a posture."""
        self.command = _HELD * (np.asarray(target_q) - self.cell.q) - _DAMPED * self.cell.dq

    def step(self) -> None:
        """Go on by a millisecond."""
        self.sample = self.cell.step(self.command)

    def _torque_control(self, torques: Any) -> None:
        raise NotImplementedError

    def set_hand_goal(self, width: float, max_velocity: float, max_force: float) -> None:
        """There is no gripper."""

    def _get_hand_width(self) -> float:
        return 0.0


class Server(FrankaRobotServer):  # type: ignore[misc]
    """The server, which counts the torques that it gets."""

    commands = 0

    def _handle_udp_command(self, command_data: bytes) -> None:
        self.commands += 1
        super()._handle_udp_command(command_data)


def build(scene: Scene) -> WorkCell:
    """Return the cell of a scene."""
    robot = Robot.load("fr3")
    tip = Dynamics(robot).pose(robot.home)[1]
    fixtures = []
    if scene.obstacle:
        face = tip[1] + scene.reach_m
        top = tip[2] + 0.03
        fixtures = [Box(name="post", centre_m=(tip[0], face + 0.02, top / 2), size_m=(0.08, 0.04, top))]
    hands = []
    if scene.hand_s is not None:
        link = robot.link_names[-1]
        hands = [Push(link=link, force_n=(0.0, 18.0, 0.0), start_s=scene.hand_s, hold_s=0.3)]
    config = CellConfig() if scene.contact_time_s is None else CellConfig(contact_time_s=scene.contact_time_s)
    return WorkCell(robot, fixtures, hands=hands, config=config)


def serve(host: str, scene: Scene) -> None:
    """Serve until the standard input ends."""
    run_in_real_time()
    robot = CellRobot(build(scene))
    server = Server(robot, [host])
    server.init()
    print(json.dumps({"ready": host}), flush=True)
    credit = granted = answered = unasked = 0
    in_step, last = False, time.monotonic()
    try:
        while True:
            server.process_commands()
            if select.select([sys.stdin], [], [], 0)[0]:
                got = os.read(sys.stdin.fileno(), 4096)
                if not got:
                    break
                credit += len(got)
                granted += len(got)
            moving = server.current_motion_id > 0
            due = server.commands > answered if moving else credit > 0
            patience_s = _STARVED_S if answered or (granted and not moving) else _HANDSHAKE_S
            if not due and time.monotonic() - last < patience_s:
                time.sleep(2e-5)
                continue
            unasked += moving and not due
            answered, credit, last = server.commands, 0 if moving else max(0, credit - 1), time.monotonic()
            robot.step()
            if server.udp_connected:
                server.send_state()
            if due and not moving and not in_step:
                in_step = True
                print(json.dumps({"in_step": True}), flush=True)
    finally:
        server.reset_state()
        server.cleanup()
    held = robot.sample.q.copy()
    for _ in range(1500):  # what the arm does without its client
        robot.joint_position_control(held)
        robot.step()
    contacts = [
        {"kind": contact.kind, "touch_s": contact.touch_s, "end_s": contact.end_s, "peak_force_n": contact.peak_force_n}
        for contact in robot.cell.contacts
    ]
    speed = float(np.abs(robot.cell.dq).max())
    counts = {"commands": server.commands, "unasked": unasked}
    print(json.dumps({**counts, "contacts": contacts, "speed": speed}), flush=True)


if __name__ == "__main__":
    serve(sys.argv[1], Scene(**json.loads(sys.argv[2])))
