"""The work cell."""

from __future__ import annotations

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

_BOUNCE_S = 0.1


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
        self.data.qpos[:] = start
        self._link_of_body = {self.model.body(name).id: i for i, name in enumerate(robot.link_names)}
        self._fixture_of_body = {
            self.model.body(fixture.name).id: TouchLog("collision", fixture.name) for fixture in fixtures
        }
        self._hands = []
        for number, hand in enumerate(hands):
            if hand.link not in robot.link_names:
                raise TactfulError(f"a hand touches {hand.link!r}, but the links are {', '.join(robot.link_names)}")
            name = "hand" if len(hands) == 1 else f"hand {number + 1}"
            self._hands.append((hand, self.model.body(hand.link).id, TouchLog("cooperation", name)))
        kinds = mujoco.mjtConstraint
        self._contact_types = (
            kinds.mjCNSTR_CONTACT_FRICTIONLESS,
            kinds.mjCNSTR_CONTACT_PYRAMIDAL,
            kinds.mjCNSTR_CONTACT_ELLIPTIC,
        )
        self._sensors = Sensors(robot.n, sensors or SensorConfig(), rng or np.random.default_rng(0), config.period_s)
        self._steps = 0
        self._samples: list[Sample] = []
        self.tau_ext = np.zeros(robot.n)
        self._jacobian = np.zeros((3, self.model.nv))
        self._force = np.zeros(6)
        self._begin()

    def _begin(self) -> None:
        """Bring kinematics and contacts up to the present, and measure."""
        self.t = self._steps * self.config.period_s
        self._mujoco.mj_step1(self.model, self.data)
        self.q, self.dq = self._sensors.motion(self.data.qpos, self.data.qvel)

    def step(self, tau: ArrayLike) -> Sample:
        """Hold the commanded torque tau (n,) [Nm] for one period, and return the sample at its begin.

        Raises:
            TactfulError: if the torque does not fit the arm, or the simulation has become unstable.
        """
        command = np.asarray(tau, dtype=np.float64)
        if command.shape != (self.robot.n,) or not np.isfinite(command).all():
            raise TactfulError(f"tau is {command.tolist()}, but {self.robot.name} needs {self.robot.n} finite numbers")
        model, data = self.model, self.data
        data.ctrl[:] = command
        hand_forces = self._touch(self.t)
        self._mujoco.mj_step2(model, data)
        sample = Sample(self.t, self.q, self.dq, self._sensors.torque(self._observe(hand_forces)))
        self._samples.append(sample)
        for k in range(1, self.config.substeps):
            self._mujoco.mj_step1(model, data)
            self._touch(self.t + k * model.opt.timestep)
            self._mujoco.mj_step2(model, data)
        if not np.isfinite(data.qacc).all() or data.warning[self._mujoco.mjtWarning.mjWARN_BADQACC].number:
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

    def _touch(self, t: float) -> list[float]:
        """Apply the forces of the hands at the time t [s], and return their magnitudes [N]."""
        data = self.data
        data.qfrc_applied[:] = 0.0
        magnitudes = []
        for hand, body, _ in self._hands:
            point = data.xpos[body] + data.xmat[body].reshape(3, 3) @ np.array(hand.point_m)
            self._mujoco.mj_jac(self.model, data, self._jacobian, None, point, body)
            force = hand.force(t, point, self._jacobian @ data.qvel)
            data.qfrc_applied += self._jacobian.T @ force
            magnitudes.append(float(np.linalg.norm(force)))
        return magnitudes

    def _observe(self, hand_forces: list[float]) -> Array:
        """Note what touches the arm, and return the torque that the sensors are to measure (n,) [Nm]."""
        model, data = self.model, self.data
        for (_, body, log), magnitude in zip(self._hands, hand_forces, strict=True):
            log.add(self.t, self._link_of_body[body], magnitude)
        contact_torque = np.zeros(model.nv)
        if data.ncon:
            touching = np.where(np.isin(data.efc_type, self._contact_types), data.efc_force, 0.0)
            self._mujoco.mj_mulJacTVec(model, data, contact_torque, touching)
            self._note_contacts()
        self.tau_ext = contact_torque + data.qfrc_applied
        if self.robot.torque_sensor == "motor":
            return data.qfrc_actuator.copy()  # type: ignore[no-any-return]
        inside = data.qfrc_passive + data.qfrc_constraint - contact_torque  # friction and the stops of the joints
        return data.qfrc_actuator + inside - model.dof_armature * data.qacc  # type: ignore[no-any-return]

    def _note_contacts(self) -> None:
        """Note the force of every fixture on every link."""
        model, data = self.model, self.data
        forces: dict[tuple[int, int], Array] = {}
        for number, contact in enumerate(data.contact):
            first, second = (int(model.geom_bodyid[geom]) for geom in contact.geom)
            fixture, link_body, sign = (first, second, 1.0) if first in self._fixture_of_body else (second, first, -1.0)
            if link_body not in self._link_of_body:
                continue
            self._mujoco.mj_contactForce(model, data, number, self._force)
            force = sign * contact.frame.reshape(3, 3).T @ self._force[:3]  # on the link, base axes
            key = (fixture, self._link_of_body[link_body])
            forces[key] = forces.get(key, 0.0) + force
        for (fixture, link), force in forces.items():
            self._fixture_of_body[fixture].add(self.t, link, float(np.linalg.norm(force)))

    @property
    def contacts(self) -> tuple[TrueContact, ...]:
        """What touched the arm so far, in the order of the first touch."""
        logs = [*self._fixture_of_body.values(), *(log for _, _, log in self._hands)]
        return tuple(sorted((c for log in logs for c in log.contacts(_BOUNCE_S)), key=lambda contact: contact.touch_s))

    def recording(self, source: str = "simulation") -> Recording:
        """Return all samples so far; its labels are the contacts that reached 1 N."""
        t, q, dq, tau = (np.array(column) for column in zip(*self._samples, strict=True))
        labels = tuple(contact.label() for contact in self.contacts if contact.visible_s is not None)
        return Recording(
            t=t, channels={"q": q, "dq": dq, "tau": tau}, labels=labels, source=source, format="simulation"
        )
