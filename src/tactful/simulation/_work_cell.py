"""The work cell."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tactful.control import CartesianImpedance, Pose
from tactful.errors import TactfulError
from tactful.recordings import Recording
from tactful.robots import Robot
from tactful.simulation._config import CellConfig, SensorConfig
from tactful.simulation._fixtures import Fixture, Table
from tactful.simulation._hands import Hand
from tactful.simulation._model import build_model
from tactful.simulation._sensors import Sensors
from tactful.simulation._truth import TouchLog, TrueContact

Array = NDArray[np.float64]

_BOUNCE_S = 0.2
"""Touches of one thing, or of one hand, that lie at most so far apart are one contact: bounces are not new ones [s]."""


class Sample(NamedTuple):
    """What the sensors say at one instant."""

    t: float
    """Time [s]."""
    q: Array
    """Joint positions (n,) [rad]."""
    dq: Array
    """Joint velocities (n,) [rad/s]."""
    tau: Array
    """Joint torques, gravity included (n,) [Nm]."""


class WorkCell:
    r"""An arm under torque control among things that it can meet and hands that touch it, in MuJoCo.

    Each `step` holds the commanded torque for one period and returns the sample at its begin. Position, velocity,
    torque and the true external torque of a sample belong to the same instant, at which, without sensor errors,

        M ddq + C dq + g = tau + tau_ext

    where M holds the rotors only if the torque is measured on the motor's side (`Robot.torque_sensor`). On the link's
    side `tau` is what comes through the gear: what was commanded plus g, less what accelerates the rotor and what its
    friction takes. Gravity is compensated by the arm itself.

    tau_ext is exact: J_c^T f over MuJoCo's contact forces, plus the joint torques of the hands' forces.

    Args:
        robot: the arm.
        fixtures: what stands in the cell besides the table.
        hands: what touches the arm and when.
        config: how the cell runs.
        sensors: what the sensors make of the truth.
        q: joint positions at the start (n,) [rad], `robot.home` by default; the arm starts at rest.
        rng: where the noise comes from; by default always the same.
        arm_rng: where offsets and phases of ripple come from, which stay with an arm; by default `rng`.
        keep: whether the samples are kept for `recording`.

    Attributes:
        robot: the arm.
        model: the `mujoco.MjModel`.
        data: the `mujoco.MjData`.
        t: time [s].
        q: measured joint positions now (n,) [rad].
        dq: measured joint velocities now (n,) [rad/s].
        tau_ext: true external joint torque at the last sample (n,) [Nm].

    Raises:
        TactfulError: if MuJoCo is not installed, the cell cannot be built, or a hand touches a link that is not there.

    Example:
        >>> from tactful import Robot
        >>> from tactful.control import CartesianImpedance
        >>> from tactful.dynamics import Dynamics
        >>> from tactful.simulation import WorkCell
        >>> panda = Robot.load("panda")
        >>> cell = WorkCell(panda)
        >>> rest = Dynamics(panda).pose(panda.home)
        >>> samples = list(cell.run(CartesianImpedance(panda), lambda t: rest, 0.01))
        >>> len(samples), cell.recording().rate_hz
        (10, 1000.0)
    """

    def __init__(
        self,
        robot: Robot,
        fixtures: Sequence[Fixture] = (),
        *,
        hands: Sequence[Hand] = (),
        config: CellConfig | None = None,
        sensors: SensorConfig | None = None,
        q: ArrayLike | None = None,
        rng: np.random.Generator | None = None,
        arm_rng: np.random.Generator | None = None,
        keep: bool = True,
    ) -> None:
        self.robot = robot
        self.config = config = config or CellConfig()
        fixtures = (Table(), *fixtures)
        self.model = build_model(robot, fixtures, config)
        import mujoco

        self._mujoco = mujoco
        self.data = mujoco.MjData(self.model)
        start = np.asarray(robot.home if q is None else q, dtype=np.float64)
        if start.shape != (robot.n,):
            raise TactfulError(f"q has shape {start.shape}, but {robot.name} has {robot.n} joints")
        self._joints = slice(None, None, 2 if config.elastic else 1)  # what the motors turn
        self._ends = slice(1 if config.elastic else 0, None, 2 if config.elastic else 1)  # what the links feel
        self.data.qpos[self._joints] = start
        self._link_of_body = {self.model.body(name).id: i for i, name in enumerate(robot.link_names)}
        self._fixture_of_body = {
            self.model.body(fixture.name).id: TouchLog("collision", fixture.name) for fixture in fixtures
        }
        self._hands: list[tuple[Hand, int, TouchLog]] = []
        for hand in hands:
            self.add_hand(hand)
        self._touched = False
        self._first_contact = int(mujoco.mjtConstraint.mjCNSTR_CONTACT_FRICTIONLESS)  # contacts are the last types
        rng = rng or np.random.default_rng(0)
        self._sensors = Sensors(robot.n, sensors or SensorConfig(), rng, config.period_s, arm_rng)
        self._steps = 0
        self._keep = keep
        self._samples: list[Sample] = []
        self.tau_ext = np.zeros(robot.n)
        self._jacobian = np.zeros((3, self.model.nv))
        self._force = np.zeros(6)
        self._begin()

    def add_hand(self, hand: Hand) -> None:
        """Let a hand touch the arm from now on, whenever it acts.

        Raises:
            TactfulError: if it touches a link that is not there.
        """
        if hand.link not in self.robot.link_names:
            raise TactfulError(f"a hand touches {hand.link!r}, but the links are {', '.join(self.robot.link_names)}")
        log = TouchLog("cooperation", "hand" if not self._hands else f"hand {len(self._hands) + 1}")
        self._hands.append((hand, self.model.body(hand.link).id, log))

    def move(self, fixture: str, centre_m: ArrayLike) -> None:
        """Put a movable fixture elsewhere (3,) [m]; move it in small steps, or it appears inside of the arm.

        Raises:
            TactfulError: if there is none of that name that is movable.
        """
        body = self._mujoco.mj_name2id(self.model, self._mujoco.mjtObj.mjOBJ_BODY, fixture)
        number = self.model.body_mocapid[body] if body >= 0 else -1
        if number < 0:
            raise TactfulError(f"no fixture {fixture!r} in the cell is movable")
        self.data.mocap_pos[number] = centre_m

    def _begin(self) -> None:
        """Bring kinematics and contacts up to the present, and measure."""
        self.t = self._steps * self.config.period_s
        self._mujoco.mj_step1(self.model, self.data)
        q, dq = self.data.qpos, self.data.qvel
        if self.config.elastic:
            q, dq = q[0::2] + q[1::2], dq[0::2] + dq[1::2]
        self.q, self.dq = self._sensors.motion(q, dq)

    def step(self, tau: ArrayLike) -> Sample:
        """Hold the commanded torque tau (n,) [Nm] for one period, and return the sample at its begin.

        The force of a hand is held as well.

        Raises:
            TactfulError: if the torque does not fit the arm, or the simulation has become unstable.
        """
        command = np.asarray(tau, dtype=np.float64)
        if command.shape != (self.robot.n,) or not np.isfinite(command).all():
            raise TactfulError(f"tau is {command.tolist()}, but {self.robot.name} needs {self.robot.n} finite numbers")
        model, data = self.model, self.data
        data.ctrl[:] = command
        self._touch()
        self._mujoco.mj_step2(model, data)
        sample = Sample(self.t, self.q, self.dq, self._sensors.torque(self._observe()))
        if self._keep:
            self._samples.append(sample)
        for _ in range(1, self.config.substeps):
            self._mujoco.mj_step(model, data)
        if not math.isfinite(data.qacc.sum()) or data.warning[self._mujoco.mjtWarning.mjWARN_BADQACC].number:
            raise TactfulError(
                f"the simulation became unstable at {self.t:.3f} s: choose softer gains or more substeps"
            )
        self._steps += 1
        self._begin()
        return sample

    def run(
        self, controller: CartesianImpedance, reference: Callable[[float], Pose], duration_s: float
    ) -> Iterator[Sample]:
        """Let a controller follow a reference for a while, and yield the samples as they come.

        Args:
            controller: what commands the torque from the measured motion.
            reference: the pose that the tip should have at the time t [s].
            duration_s: for how long [s].
        """
        for _ in range(round(duration_s / self.config.period_s)):
            yield self.step(controller.torque(self.q, self.dq, *reference(self.t)))

    def _touch(self) -> None:
        """Apply and note the forces that the hands exert now."""
        data = self.data
        if self._touched:
            data.qfrc_applied[:] = 0.0
            self._touched = False
        for hand, body, log in self._hands:
            if not hand.acts(self.t):
                continue
            point = data.xpos[body] + data.xmat[body].reshape(3, 3) @ hand.point_m
            self._mujoco.mj_jac(self.model, data, self._jacobian, None, point, body)
            force = hand.force(self.t, point, self._jacobian @ data.qvel)
            data.qfrc_applied += self._jacobian.T @ force
            log.add(self.t, self._link_of_body[body], math.sqrt(force @ force))
            self._touched = True

    def _observe(self) -> Array:
        """Note what touches the arm, and return the torque that the sensors are to measure (n,) [Nm]."""
        model, data = self.model, self.data
        external = data.qfrc_applied.copy()
        if data.ncon:
            contact_torque = np.zeros(model.nv)
            touching = np.where(data.efc_type >= self._first_contact, data.efc_force, 0.0)
            self._mujoco.mj_mulJacTVec(model, data, contact_torque, touching)
            external += contact_torque
            self._note_contacts()
        self.tau_ext = external[self._ends]
        if self.robot.torque_sensor == "motor":
            return data.qfrc_actuator[self._joints].copy()  # type: ignore[no-any-return]
        inside = data.qfrc_passive + data.qfrc_constraint - external + data.qfrc_applied  # springs, friction, stops
        return (data.qfrc_actuator + inside - model.dof_armature * data.qacc)[self._ends]  # type: ignore[no-any-return]

    def _note_contacts(self) -> None:
        """Note the force of every fixture on every link."""
        model, data = self.model, self.data
        contacts = data.contact
        bodies, frames = model.geom_bodyid[contacts.geom], contacts.frame  # (c, 2), (c, 9)
        forces: dict[tuple[int, int], Array] = {}
        for number, (first, second) in enumerate(bodies.tolist()):
            fixture, link_body, sign = (first, second, 1.0) if first in self._fixture_of_body else (second, first, -1.0)
            if link_body not in self._link_of_body:
                continue
            self._mujoco.mj_contactForce(model, data, number, self._force)
            force = sign * (self._force[:3] @ frames[number].reshape(3, 3))  # on the link, base axes
            key = (fixture, self._link_of_body[link_body])
            forces[key] = forces.get(key, 0.0) + force
        for (fixture, link), force in forces.items():
            self._fixture_of_body[fixture].add(self.t, link, math.sqrt(force @ force))

    @property
    def contacts(self) -> tuple[TrueContact, ...]:
        """What touched the arm so far, in the order of the first touch."""
        logs = [*self._fixture_of_body.values(), *(log for _, _, log in self._hands)]
        return tuple(sorted((c for log in logs for c in log.contacts(_BOUNCE_S)), key=lambda contact: contact.touch_s))

    @property
    def contacts_so_far(self) -> tuple[str, ...]:
        """Which kinds of contact there have been, collisions first; quicker than `contacts`."""
        collided = any(log.times for log in self._fixture_of_body.values())
        helped = any(log.times for _, _, log in self._hands)
        return ("collision",) * collided + ("cooperation",) * helped

    def recording(self, source: str = "simulation") -> Recording:
        """Return all samples so far as the sensors log them; its labels are the contacts that reached 1 N."""
        t, q, dq, tau = (np.array(column) for column in zip(*self._samples, strict=True))
        t, rows = self._sensors.stamps(t)
        q, dq, tau = q[rows], dq[rows], tau[rows]
        labels = tuple(contact.label() for contact in self.contacts if contact.visible_s is not None)
        return Recording(
            t=t, channels={"q": q, "dq": dq, "tau": tau}, labels=labels, source=source, format="simulation"
        )
