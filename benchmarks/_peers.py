"""The same chain as it is written with Pinocchio's and MuJoCo's Python functions, and numpy for all the rest.

A peer computes what `Monitor` documents: the residual of the generalized momentum observer in its trapezoidal form, the
wrench at the tip that explains it, damped near singularities, the largest amplitude of each force axis in the band, and
from these whether there is contact. It skips a sample that is not finite and remembers the last second, as a classifier
needs it. It does not tell kinds of contact.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tactful import MonitorConfig, Robot

Array = NDArray[np.float64]
Terms = tuple[Array, Array, Array, Array]


class Peer(ABC):
    """A contact detector for one sample after the other.

    Args:
        robot: an arm with revolute joints and torque sensors on the link's side.
        config: the settings.
    """

    def __init__(self, robot: Robot, config: MonitorConfig) -> None:
        self._damped_below, self._damping = config.wrench.damped_below, config.wrench.damping
        self._identity = np.eye(6)
        self._gain = 2 * np.pi * float(config.observer.bandwidth_hz)  # type: ignore[arg-type]
        self._t = -np.inf
        self.r = self._p = self._s = np.zeros(robot.n)
        self.F = np.zeros(6)
        self.level = np.zeros(3)
        self.contact = False
        self._threshold = np.broadcast_to(config.frequency.threshold_n, 3).tolist()
        self._release = [config.contact.release_ratio * threshold for threshold in self._threshold]
        self._hold = round(config.contact.hold_s * config.rate_hz)
        self._quiet = [0, 0, 0]
        self._until_ready = config.frequency.window + round(config.contact.warm_up_s * config.rate_hz)
        self._history = np.zeros((round(config.rate_hz), robot.n + 15))
        self._taken = 0
        N = self._N = config.frequency.window
        low, high = config.frequency.band_hz
        bins = np.arange(np.ceil(low * N / config.rate_hz), np.floor(high * N / config.rate_hz) + 1).astype(int)
        self._bins = slice(bins[0], bins[-1] + 1)
        self._twiddle = np.exp(-2j * np.pi * np.outer(np.arange(N), bins) / N)[:, :, None]  # (N, K, 1)
        self._window = np.zeros((N, 3))
        self._sums = np.zeros((len(bins), 3), complex)
        self._n = 0

    @abstractmethod
    def terms(self, q: Array, dq: Array) -> Terms:
        """Return M dq (n,), C^T dq (n,), g (n,) and the Jacobian of the tip (6, n)."""

    def estimate(self, t: float, q: Array, dq: Array, tau: Array) -> Array:
        """Take one sample, set the residual `r` (n,) [Nm] and the wrench `F` (6,) [N, Nm], and return the Jacobian."""
        p, ctdq, g, J = self.terms(q, dq)
        s = tau + ctdq - g
        if self._t == -np.inf:
            self.r = -s
        else:
            half, K = 0.5 * (t - self._t), self._gain
            change = p - self._p - half * (s + self._s)
            self.r = (1 - half * K) / (1 + half * K) * self.r + K / (1 + half * K) * change
        self._t, self._p, self._s = t, p, s
        A = J @ J.T
        inverse = np.linalg.inv(A)
        bound = inverse.trace() ** -0.5  # of the smallest singular value of J
        if bound < self._damped_below:
            damping = self._damping**2 * (1 - (bound / self._damped_below) ** 2)
            inverse = np.linalg.inv(A + damping * self._identity)
        self.F = inverse @ (J @ self.r)
        return J

    def update(self, t: float, q: Array, dq: Array, tau: Array) -> None:
        """Take one sample and set the `level` (3,) [N] and whether there is `contact` too."""
        if not math.isfinite(q @ q + dq @ dq + tau @ tau):
            return
        J = self.estimate(t, q, dq, tau)
        n, x = self._n, self.F[:3]
        self._sums += (x - self._window[n]) * self._twiddle[n]
        self._window[n] = x
        self._n = n + 1
        if self._n == self._N:  # from the start, so that rounding does not accumulate
            self._n = 0
            self._sums = np.fft.rfft(self._window, axis=0)[self._bins]
        self.level = 2 / self._N * np.abs(self._sums).max(axis=0)
        row = self._history[self._taken % len(self._history)]
        row[:6], row[6:12], row[12:15], row[15:] = self.F, J @ dq, self.level, self.r
        self._taken += 1
        if self._taken >= self._until_ready:
            self._advance()

    def _advance(self) -> None:
        over, quiet = False, True
        for i, level in enumerate(self.level.tolist()):
            over = over or level > self._threshold[i]
            self._quiet[i] = 0 if level > self._release[i] else self._quiet[i] + 1
            quiet = quiet and self._quiet[i] > self._hold
        self.contact = not quiet if self.contact else over


class PinocchioPeer(Peer):
    """The terms from Pinocchio: M dq by RNEA, which takes less time than CRBA and a product."""

    def __init__(self, robot: Robot, config: MonitorConfig) -> None:
        import pinocchio

        super().__init__(robot, config)
        self._pin: Any = pinocchio
        self._model = model = pinocchio.Model()
        for i in range(robot.n):
            place = pinocchio.SE3(robot.rotation[i].copy(), robot.translation[i].copy())
            joint = model.addJoint(i, _joint(pinocchio, robot.axis[i]), place, robot.joint_names[i])
            body = pinocchio.Inertia(float(robot.mass[i]), robot.com[i].copy(), robot.inertia[i].copy())
            model.appendBodyToJoint(joint, body, pinocchio.SE3.Identity())
        model.gravity.linear = robot.gravity.copy()
        tip = robot.frames[robot.tip]
        place = pinocchio.SE3(np.array(tip.rotation), np.array(tip.translation))
        kind = pinocchio.FrameType.OP_FRAME
        self._tip = model.addFrame(pinocchio.Frame(robot.tip, tip.link + 1, place, kind))
        self._data = model.createData()
        self._axes = pinocchio.ReferenceFrame.LOCAL_WORLD_ALIGNED
        self._zero = np.zeros(robot.n)

    def terms(self, q: Array, dq: Array) -> Terms:
        """See `Peer.terms`."""
        pin, model, data = self._pin, self._model, self._data
        g = pin.computeGeneralizedGravity(model, data, q)
        p = pin.rnea(model, data, q, self._zero, dq) - g
        C = pin.computeCoriolisMatrix(model, data, q, dq)  # (n, n); places the joints and their Jacobians on its way
        pin.updateFramePlacement(model, data, self._tip)
        return p, dq @ C, g, pin.getFrameJacobian(model, data, self._tip, self._axes)


def _joint(pinocchio: Any, axis: Array) -> Any:
    """Return the fastest revolute joint for an axis."""
    for unit, kind in zip(np.eye(3), "XYZ", strict=True):
        if np.array_equal(axis, unit):
            return getattr(pinocchio, f"JointModelR{kind}")()
    return pinocchio.JointModelRevoluteUnaligned(axis.copy())


class MujocoPeer(Peer):
    """The terms from MuJoCo, which has no Coriolis matrix.

    `mj_rnePostConstraint` at rest, without gravity and with the velocity in place of the acceleration leaves the
    momentum H_i of the links from i on in `cfrc_int`; then M dq = S_i . H_i and C^T dq = dS_i/dt . H_i, with `cdof` for
    S_i and `cdof_dot` for its rate. That is exact, and faster than M by `mj_crb` with differences of it.
    """

    def __init__(self, robot: Robot, config: MonitorConfig) -> None:
        import mujoco

        super().__init__(robot, config)
        self._mujoco: Any = mujoco
        self._model = mujoco.MjModel.from_xml_string(robot.to_mjcf())
        self._data = mujoco.MjData(self._model)
        self._gravity = robot.gravity.copy()
        self._bodies = slice(int(self._model.jnt_bodyid[0]), int(self._model.jnt_bodyid[-1]) + 1)
        self._tip = mujoco.mj_name2id(self._model, mujoco.mjtObj.mjOBJ_SITE, robot.tip)
        self._g = np.zeros(robot.n)
        self._J = np.zeros((6, robot.n))

    def terms(self, q: Array, dq: Array) -> Terms:
        """See `Peer.terms`."""
        mujoco, model, data = self._mujoco, self._model, self._data
        data.qpos[:] = q
        data.qvel[:] = 0.0
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        mujoco.mj_comVel(model, data)
        mujoco.mj_rne(model, data, 0, self._g)
        data.qacc[:] = dq
        model.opt.gravity[:] = 0.0
        mujoco.mj_rnePostConstraint(model, data)
        model.opt.gravity[:] = self._gravity
        data.qvel[:] = dq
        mujoco.mj_comVel(model, data)
        mujoco.mj_jacSite(model, data, self._J[:3], self._J[3:], self._tip)
        H = data.cfrc_int[self._bodies]  # (n, 6)
        p = np.einsum("ij,ij->i", data.cdof, H)
        return p, np.einsum("ij,ij->i", data.cdof_dot, H), self._g, self._J
