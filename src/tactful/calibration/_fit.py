"""The fit: what of the arm's figures explains the residual, and how sure that is."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from tactful.calibration._columns import HYSTERESIS_RAD, Columns
from tactful.calibration._pseudo_inertia import PARAMETERS, LinkChart, robot_parameters, with_parameters
from tactful.estimation import ObserverConfig
from tactful.robots import Robot

Array = NDArray[np.float64]

LINK_SPREAD = 0.3
"""Standard deviation of a link's distance from its nominal figures, in the affine-invariant metric: about 30 %."""
_MOTOR_SPREAD_KG_M2 = 0.5
_PAYLOAD_SPREAD_KG = 3.0
_PAYLOAD_SPREAD_M = 0.1
_BLOCK_S = 0.1
"""Time over which the size of the residual is looked at to find outliers [s]."""
_OUTLIER = 4.0
"""Size of the residual, in its usual ones, at which a block has half its weight."""
_ROUNDS = 4
_PAYLOAD_EVIDENCE = 12.0
"""Fall of the cost from which a payload is believed to be there: exp(12) to one."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Fit:
    """A calibrated arm.

    Attributes:
        robot: the corrected arm, its payload included.
        links: the corrected arm without the payload.
        bias, coulomb, viscous: (n,) [Nm, Nm, Nms].
        hysteresis: (n,) [rad].
        payload_kg: mass of the payload [kg]; 0 without one.
        payload_com_m: its centre of mass in the tip frame (3,) [m].
        sd: standard deviations of `bias`, `coulomb`, `viscous`, `motor_inertia`, `payload` (mass and centre of mass),
            and of the links' `mass` and `first_moment`.
        residual: what is left of the residual (k, n) [Nm].
        size: usual size of the residual (n,) [Nm].
        weight: of the rows, 1 without contact (k,).
        determined: how many inertial parameters the motion determined rather than the nominal model.
        solution: where the fit ended, for `of`.
    """

    robot: Robot
    links: Robot
    bias: Array
    coulomb: Array
    viscous: Array
    hysteresis: Array
    payload_kg: float
    payload_com_m: Array
    sd: dict[str, Array]
    residual: Array
    size: Array
    weight: Array
    determined: float
    solution: _Solution

    def of(self, rows: NDArray[np.bool_]) -> Fit:
        """Return the fit to some of the rows, with the weights and the models of friction of this one."""
        whole = self.solution
        part = replace(whole, weight=whole.weight[rows])
        problem = whole.problem
        known = None if problem.payload else (self.payload_kg, self.payload_com_m)
        columns = problem.columns.of(rows)
        return _solve(columns, problem.robot, payload=problem.payload, like=part).result(known)

    def observer(self, config: ObserverConfig) -> ObserverConfig:
        """Return the observer with the bias and friction that were found."""
        found = {"bias_nm": self.bias, "coulomb_nm": self.coulomb, "viscous_nms": self.viscous}
        values: dict[str, Any] = {key: _rounded(value) for key, value in found.items()}
        return config.model_copy(update={**values, "hysteresis_rad": tuple(float(x) for x in self.hysteresis)})


def _rounded(values: Array) -> tuple[float, ...]:
    return tuple(float(f"{value:.6g}") for value in values)


class _Problem:
    """The cost of the coordinates: links (10 n), motors (n or 0), bias, Coulomb, viscous (n each), payload (4 or 0)."""

    def __init__(self, columns: Columns, robot: Robot, *, payload: bool) -> None:
        n = robot.n
        self.columns, self.robot, self.payload = columns, robot, payload
        self.charts = [LinkChart(row) for row in robot_parameters(robot)]
        self.motor = robot.torque_sensor == "motor"
        self.links = slice(0, PARAMETERS * n)
        self.motors = slice(self.links.stop, self.links.stop + n * self.motor)
        self.bias, self.coulomb, self.viscous = (
            slice(self.motors.stop + k * n, self.motors.stop + (k + 1) * n) for k in range(3)
        )
        self.load = slice(self.viscous.stop, self.viscous.stop + 4 * payload)
        self.size = self.load.stop
        torque = np.maximum(np.abs(columns.r).max(axis=0), 1.0)  # (n,) [Nm]
        speed = np.maximum(np.abs(columns.v).max(axis=0), 0.1)
        self.prior = np.ones(self.size)
        self.prior[self.links] = np.tile(LINK_SPREAD * LinkChart.scale, n)
        self.prior[self.motors] = _MOTOR_SPREAD_KG_M2
        self.prior[self.bias] = torque
        self.prior[self.coulomb] = torque
        self.prior[self.viscous] = torque / speed
        self.prior[self.load] = (_PAYLOAD_SPREAD_KG, *(_PAYLOAD_SPREAD_M,) * 3)[: 4 * payload]
        self.lower = np.full(self.size, -np.inf)
        self.start = np.zeros(self.size)
        for part in (self.motors, self.coulomb, self.viscous):
            self.lower[part] = 0.0
            self.start[part] = 1e-3
        if self.motor:
            self.lower[self.motors] = -robot.motor_inertia
        if payload:
            self.lower[self.load.start] = 0.0
            self.start[self.load.start] = 0.1
        tip = robot.frames[robot.tip]
        self.carrier, self.tip = tip.link, tip

    def load_parameters(self, x: Array) -> tuple[Array, Array]:
        """Return what the payload adds to its link (10,) and the derivative (10, 4)."""

        def added(mass: float, com: Array) -> Array:
            c = self.tip.rotation @ com + self.tip.translation
            S = c @ c * np.eye(3) - np.outer(c, c)
            return mass * np.array([1.0, *c, S[0, 0], S[0, 1], S[0, 2], S[1, 1], S[1, 2], S[2, 2]])

        mass, com = float(x[0]), x[1:]
        value = added(mass, com)
        slope = np.empty((PARAMETERS, 4))
        slope[:, 0] = added(1.0, com)
        for k, e in enumerate(1e-5 * np.eye(3)):
            slope[:, k + 1] = (added(mass, com + e) - added(mass, com - e)) / 2e-5
        return value, slope

    def delta(self, x: Array) -> tuple[Array, Array]:
        """Return the change of the columns' coefficients (C,) and its derivative (C, size)."""
        n = self.robot.n
        links = PARAMETERS * n
        count = links + n + (2 + 1) * n
        value, slope = np.zeros(count), np.zeros((count, self.size))
        for i, chart in enumerate(self.charts):
            own = slice(PARAMETERS * i, PARAMETERS * (i + 1))
            parameters, derivative = chart(x[own])
            value[own] = parameters - chart.nominal
            slope[own, own] = derivative
        if self.payload:
            own = slice(PARAMETERS * self.carrier, PARAMETERS * (self.carrier + 1))
            added, derivative = self.load_parameters(x[self.load])
            value[own] += added
            slope[own, self.load] = derivative
        parts = [(links + n, self.bias), (links + 2 * n, self.viscous), (links + 3 * n, self.coulomb)]
        if self.motor:
            parts.append((links, self.motors))
        for start, part in parts:
            value[start : start + n] = x[part]
            slope[start + np.arange(n), np.arange(part.start, part.stop)] = 1.0
        return value, slope

    def solve(self, A: Array, weight: Array, x: Array) -> tuple[Array, Array, float]:
        """Return the coordinates, their covariance and the cost for weights (k, n), with A (k, n, C)."""
        C = A.shape[-1]
        flat = (A * np.sqrt(weight)[..., None]).reshape(-1, C)
        target = (self.columns.r * np.sqrt(weight)).ravel()
        H, b, c = flat.T @ flat, flat.T @ target, float(target @ target)
        values, vectors = np.linalg.eigh(H)
        good = values > 1e-12 * values[-1]
        root = np.sqrt(values[good])[:, None] * vectors[:, good].T  # H = root^T root
        offset = vectors[:, good].T @ b / np.sqrt(values[good])
        rest = c - float(offset @ offset)

        def residual(y: Array) -> Array:
            return np.concatenate([root @ self.delta(y)[0] + offset, y / self.prior])

        def jacobian(y: Array) -> Array:
            return np.concatenate([root @ self.delta(y)[1], np.diag(1 / self.prior)])

        bounds = (self.lower, np.full(self.size, np.inf))
        x = np.maximum(x, np.where(np.isfinite(self.lower), self.lower + 1e-9, x))
        result = least_squares(
            residual, x, jacobian, bounds=bounds, x_scale=self.prior, ftol=1e-6, xtol=1e-5, max_nfev=50
        )
        J = jacobian(result.x)
        covariance = np.asarray(np.linalg.inv(J.T @ J), dtype=np.float64)
        return result.x, covariance, float(result.cost) + 0.5 * rest


def fit(columns: Columns, robot: Robot, payload: tuple[float, Array] | None = None) -> Fit:
    """Fit the arm's figures to its residual in free motion.

    The maximum of the posterior: the residual's size is that of what is left of it, joint by joint, its samples count
    as far as they are independent, and blocks that stand out, such as contacts, count less. The links' prior is the
    nominal model. Of the models of friction at reversals, each joint takes the one that explains it best. A payload is
    only there where the residual says so.

    Args:
        columns: the residual and its derivatives.
        robot: the nominal arm.
        payload: mass [kg] and centre of mass in the tip frame [m] of the payload, which `columns` knows of; None: it is
            not known whether there is one.
    """
    bare = _solve(columns, robot, payload=False)
    if payload is None and robot.frames[robot.tip].link >= 0:
        loaded = _solve(columns, robot, payload=True, like=bare)
        if loaded.cost < bare.cost - _PAYLOAD_EVIDENCE:
            bare = _solve(columns, robot, payload=True)
    return bare.result(payload)


@dataclass(frozen=True, eq=False)
class _Solution:
    problem: _Problem
    x: Array
    covariance: Array
    cost: float
    choice: NDArray[np.int64]
    residual: Array
    size: Array
    weight: Array
    per_row: Array

    def result(self, known: tuple[float, Array] | None) -> Fit:
        problem, robot, x = self.problem, self.problem.robot, self.x
        n = robot.n
        rows = np.array([chart(x[PARAMETERS * i : PARAMETERS * (i + 1)])[0] for i, chart in enumerate(problem.charts)])
        motors = robot.motor_inertia + x[problem.motors] if problem.motor else None
        links = with_parameters(robot, rows, motors)
        load_kg, com_m = known or (0.0, np.zeros(3))
        if problem.payload:
            load_kg, com_m = float(x[problem.load][0]), x[problem.load][1:]
        loaded = links.with_payload(load_kg, com_m) if load_kg else links
        sd = np.sqrt(np.diag(self.covariance))
        slope = problem.delta(x)[1]
        spread = np.sqrt(np.einsum("ca,ab,cb->c", slope, self.covariance, slope))[: PARAMETERS * n].reshape(n, -1)
        information = 1 - (sd / problem.prior)[problem.links] ** 2
        return Fit(
            robot=loaded,
            links=links,
            bias=x[problem.bias],
            coulomb=x[problem.coulomb],
            viscous=x[problem.viscous],
            hysteresis=np.array(HYSTERESIS_RAD)[self.choice],
            payload_kg=load_kg,
            payload_com_m=com_m,
            sd={
                "bias": sd[problem.bias],
                "coulomb": sd[problem.coulomb],
                "viscous": sd[problem.viscous],
                "motor_inertia": sd[problem.motors],
                "payload": sd[problem.load],
                "mass": spread[:, 0],
                "first_moment": spread[:, 1:4],
            },
            residual=self.residual,
            size=self.size,
            weight=self.weight,
            determined=float(information.sum()),
            solution=self,
        )


def _solve(columns: Columns, robot: Robot, *, payload: bool, like: _Solution | None = None) -> _Solution:
    """Solve with weights that follow from the residual; `like` keeps those of another solution."""
    n = robot.n
    problem = _Problem(columns, robot, payload=payload)
    fixed = (PARAMETERS + 3) * n
    x = like.x if like is not None and like.problem.payload == payload else problem.start
    choice = np.zeros(n, dtype=np.int64) if like is None else like.choice
    weight = np.ones(len(columns.r)) if like is None else like.weight
    size = columns.r.std(axis=0) + 1e-6 if like is None else like.size
    independent = np.full(n, 0.1) if like is None else like.per_row
    for turn in range(_ROUNDS if like is None else 1):
        A = _chosen(columns, choice, fixed)
        scale = weight[:, None] * independent / size**2
        x, covariance, cost = problem.solve(A, scale, x)
        residual = columns.r + A @ problem.delta(x)[0]
        if like is None and turn < _ROUNDS - 1:
            if turn < 2:
                choice = _best_hysteresis(columns, residual, choice, x[problem.coulomb], weight, fixed)
            weight, size = _weights(columns, residual)
            independent = _independent_share(columns, residual / size)
    return _Solution(problem, x, covariance, cost, choice, residual, size, weight, independent)


def _chosen(columns: Columns, choice: NDArray[np.int64], fixed: int) -> Array:
    n = len(choice)
    return np.concatenate([columns.A[..., :fixed], columns.A[..., fixed + choice * n + np.arange(n)]], axis=-1)


def _best_hysteresis(
    columns: Columns, residual: Array, choice: NDArray[np.int64], coulomb: Array, weight: Array, fixed: int
) -> NDArray[np.int64]:
    """Return for each joint the model of friction that leaves the least, with bias and friction of the joint free."""
    n = len(choice)
    best = choice.copy()
    for i in range(n):
        column = [columns.A[:, i, fixed + h * n + i] for h in range(len(HYSTERESIS_RAD))]
        viscous, bias = columns.A[:, i, fixed - n + i], columns.A[:, i, fixed - 2 * n + i]
        without = residual[:, i] - coulomb[i] * column[choice[i]]
        left = []
        for candidate in column:
            B = np.stack([candidate, viscous, bias], axis=1) * np.sqrt(weight)[:, None]
            y = without * np.sqrt(weight)
            solution = np.linalg.lstsq(B, y, rcond=None)[0]
            left.append(float(np.sum((y - B @ solution) ** 2)))
        if min(left) < 0.98 * left[choice[i]]:
            best[i] = int(np.argmin(left))
    return best


def _weights(columns: Columns, residual: Array) -> tuple[Array, Array]:
    """Return weights of the rows (k,) and the usual size of the residual (n,)."""
    size = 1.4826 * np.median(np.abs(residual), axis=0)
    size = np.maximum(size, 1e-3 * np.abs(columns.r).max(axis=0) + 1e-6)
    block = max(1, round(_BLOCK_S * columns.rate_hz))
    starts = np.arange(0, len(residual), block)
    power = np.add.reduceat((residual / size) ** 2, starts, axis=0) / np.diff(np.append(starts, len(residual)))[:, None]
    worst = power.max(axis=1) / _OUTLIER**2
    weight = np.repeat(1 / (1 + worst**2), np.diff(np.append(starts, len(residual))))
    rms = np.sqrt(np.sum(weight[:, None] * residual**2, axis=0) / weight.sum())
    return weight, np.maximum(rms, size)


def _independent_share(columns: Columns, x: Array) -> Array:
    """Return by joint which share of the rows is independent, 1 / (1 + 2 sum of the autocorrelation)."""
    share = np.empty(x.shape[1])
    longest = max(2, round(1.0 * columns.rate_hz))
    for i in range(x.shape[1]):
        y = x[:, i] - x[:, i].mean()
        power = float(y @ y) + 1e-12
        total = 1.0
        for lag in range(1, min(longest, len(y) - 1)):
            correlation = float(y[lag:] @ y[:-lag]) / power
            if correlation < 0.05:
                break
            total += 2 * correlation
        share[i] = 1 / total
    return share
