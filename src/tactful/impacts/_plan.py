"""What a planned impact is expected to do, as the monitor needs it."""

from __future__ import annotations

import zipfile
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tactful.dynamics import Dynamics
from tactful.errors import TactfulError
from tactful.recordings import Recording
from tactful.robots import Frame, Robot
from tactful.robots._frozen import FrozenRecord, frozen_array

Array = NDArray[np.float64]

_FIELDS = ("t_d_s", "q_d", "post_t_s", "post_dq", "post_q", "turn", "window_s", "source")


class ImpactPlanError(TactfulError):
    """A plan that cannot be: `field` says which of its fields is at fault."""

    def __init__(self, field: str, problem: str) -> None:
        self.field = field
        super().__init__(f"impact plan: {field} {problem}")


@dataclass(frozen=True, eq=False)
class ContactPoint(FrozenRecord):
    """A point of the arm that is to touch, and the surface that it is to touch.

    Attributes:
        link: index of the link that the point is fixed to.
        point_m: (3,) [m] in the link's frame.
        normal: (3,) unit vector out of the surface, towards the robot, in the base frame.
    """

    link: int
    point_m: Array
    normal: Array

    def __post_init__(self) -> None:
        for name in ("point_m", "normal"):
            array = frozen_array(getattr(self, name))
            if array.shape != (3,) or not np.isfinite(array).all():
                raise ImpactPlanError(f"contact {name}", f"must be 3 finite numbers, not {array.tolist()}")
            object.__setattr__(self, name, array)
        if abs(np.linalg.norm(self.normal) - 1) > 1e-6:
            raise ImpactPlanError("contact normal", f"must have the length 1, not {np.linalg.norm(self.normal):.6g}")


@dataclass(frozen=True, eq=False)
class ImpactPlan(FrozenRecord):
    r"""An intended impact: when and where it is to happen, and how the joints are to move after it.

    All times are on one clock, that of the samples. The post-impact reference velocity \dot q_d(t) is that of a rigid
    arm, without the oscillation of its joints; it is piecewise linear between the times of its grid, which also reaches
    before t_d for an impact that comes early, and stays at its first and last value outside.

    Source: B. Proper, A. Kurdas, S. Abdolshah, S. Haddadin, A. Saccon 2023, https://hal.science/hal-03974694v3,
    Sec. III-A.

    Attributes:
        t_d_s: desired time of the impact, t_d [s].
        q_d: (n,) [rad] desired configuration at t_d.
        post_t_s: (k,) [s] increasing times of the post-impact reference.
        post_dq: (k, n) [rad/s] post-impact reference velocity at these times.
        post_q: (k, n) [rad] post-impact reference position, where known.
        window_s: how long before and how long after t_d the plan speaks for what is felt [s, s].
        contacts: the points that are to touch.
        turn: (2, n) how an error of the joints at q_d turns the tool about two axes in the surface; see `with_turn`.
        source: whether an impact map or recorded nominal runs say what follows the impact.

    Raises:
        ImpactPlanError: if a shape is wrong, a number is not finite, or time does not increase.

    Example:
        >>> from tactful.impacts import ImpactPlan
        >>> plan = ImpactPlan(0.5, [0.1, 0.2], [0.5, 0.6], [[0.0, 1.0], [0.0, 2.0]])
        >>> plan.dq_d(0.55), plan.dq_d(9.0)
        (array([0. , 1.5]), array([0., 2.]))
    """

    t_d_s: float
    q_d: Array
    post_t_s: Array
    post_dq: Array
    post_q: Array | None = None
    window_s: tuple[float, float] = (0.2, 0.5)
    contacts: tuple[ContactPoint, ...] = ()
    turn: Array | None = None
    source: Literal["impact map", "recorded"] = "impact map"

    def __post_init__(self) -> None:
        self._freeze("t_d_s", ())
        object.__setattr__(self, "t_d_s", float(self.t_d_s))
        n = len(self._freeze("q_d", (-1,)))
        k = len(self._freeze("post_t_s", (-1,)))
        if n == 0 or k == 0:
            raise ImpactPlanError("q_d" if n == 0 else "post_t_s", "is empty: give at least one number")
        self._freeze("post_dq", (k, n))
        if self.post_q is not None:
            self._freeze("post_q", (k, n))
        if self.turn is not None:
            self._freeze("turn", (2, n))
        steps = np.diff(self.post_t_s)
        if (steps <= 0).any():
            row = int(np.argmax(steps <= 0)) + 1
            raise ImpactPlanError("post_t_s", f"must increase, but does not at row {row}, {self.post_t_s[row]:g} s")
        before, after = (float(x) for x in self._freeze("window_s", (2,)))
        if before < 0 or after <= 0:
            problem = f"must be how long before (>= 0) and after (> 0) t_d, not {before:g} and {after:g} s"
            raise ImpactPlanError("window_s", problem)
        object.__setattr__(self, "window_s", (before, after))
        object.__setattr__(self, "contacts", tuple(self.contacts))
        if self.source not in ("impact map", "recorded"):
            raise ImpactPlanError("source", f"must be 'impact map' or 'recorded', not {self.source!r}")

    def _freeze(self, name: str, shape: tuple[int, ...]) -> Array:
        try:
            array = frozen_array(getattr(self, name))
        except (TypeError, ValueError) as error:
            raise ImpactPlanError(name, f"must be numbers: {error}") from None
        if array.ndim != len(shape) or any(want not in (-1, got) for want, got in zip(shape, array.shape, strict=True)):
            wanted = ", ".join("any" if size < 0 else str(size) for size in shape)
            raise ImpactPlanError(name, f"must have the shape ({wanted}), not {array.shape}")
        if not np.isfinite(array).all():
            raise ImpactPlanError(name, f"must be finite, not {array[~np.isfinite(array)][0]}")
        object.__setattr__(self, name, array)
        return array

    @property
    def n(self) -> int:
        """Number of joints."""
        return len(self.q_d)

    @property
    def start_s(self) -> float:
        """When the plan begins to speak [s]."""
        return self.t_d_s - self.window_s[0]

    @property
    def end_s(self) -> float:
        """When the plan ceases to speak [s]."""
        return self.t_d_s + self.window_s[1]

    def dq_d(self, t: float) -> Array:
        r"""Return the post-impact reference velocity \dot q_d (n,) at the time t [rad/s]."""
        times = self.post_t_s
        k = int(np.clip(np.searchsorted(times, t, side="right") - 1, 0, max(len(times) - 2, 0)))
        if len(times) == 1 or t <= times[0]:
            return np.array(self.post_dq[0])
        share = min((t - times[k]) / (times[k + 1] - times[k]), 1.0)
        return np.asarray((1.0 - share) * self.post_dq[k] + share * self.post_dq[k + 1])

    def with_turn(self, robot: Robot) -> ImpactPlan:
        """Return the plan with `turn`, so that the tilt of the tool can be told.

        Raises:
            ImpactPlanError: if there are no contact points, or the robot has another number of joints.
        """
        if not self.contacts:
            raise ImpactPlanError("contacts", "are empty: give some, they tell the tool and the surface")
        if len(robot.joint_names) != self.n:
            raise ImpactPlanError("q_d", f"has {self.n} joints, but {robot.name} has {len(robot.joint_names)}")
        J, axes = self.at_tool(robot)
        return replace(self, turn=axes[1:] @ J[3:])

    def at_tool(self, robot: Robot) -> tuple[Array, Array]:
        """Return the Jacobian (6, n) of the tool at q_d, and the surface's normal, first and second axis (3, 3).

        The first axis in the surface is the base axis that lies flattest in it, the second one completes a
        right-handed frame (first axis, normal, second axis).
        """
        contact = self.contacts[0]
        point: Array = np.mean([c.point_m for c in self.contacts if c.link == contact.link], axis=0)
        frame = Frame(contact.link, np.eye(3), point)
        J = Dynamics(replace(robot, frames={**robot.frames, "contact": frame})).jacobian(self.q_d, "contact")
        n = contact.normal
        base = np.eye(3)[int(np.argmin(np.abs(n)))]
        first = base - (base @ n) * n
        first /= np.linalg.norm(first)
        return J, np.stack([n, first, np.cross(first, n)])

    @classmethod
    def from_recordings(
        cls,
        recordings: Sequence[Recording],
        impact_s: Sequence[float] | None = None,
        *,
        settle_s: float = 0.0,
        span_s: float = 0.2,
        degree: int = 2,
        window_s: tuple[float, float] = (0.2, 0.5),
        contacts: Sequence[ContactPoint] = (),
    ) -> ImpactPlan:
        r"""Learn the plan from nominal runs, the data-driven way of the paper's experiment.

        The velocities after the impact, on the time since it, are joined over the runs, and a polynomial of low degree
        is fitted to each joint by least squares: what oscillates about it is the flexibility of joints and environment,
        the polynomial is the gross motion. t_d and q_d are the medians over the runs.

        Source: Proper et al. 2023, Sec. IV-B (it does not say how the prediction was extracted); oscillation as fast
        dynamics on a rigid response: I. Aouaj, V. Padois, A. Saccon 2021, doi:10.1109/ICRA48506.2021.9561246.

        Args:
            recordings: `Recording`s with q and dq; all start on the same event, so that their clocks agree.
            impact_s: time of the (last) impact in each recording [s]; by default the beginning of its last label whose
                kind ends with `impact`.
            settle_s: time after the impact that is left out [s].
            span_s: time after the impact over which the polynomial is fitted [s].
            degree: of the polynomial.
            window_s: as in the plan.
            contacts: as in the plan.

        Raises:
            ImpactPlanError: if there is no recording, or one has no q and dq, no known impact, or too few rows after
                it.
        """
        if not recordings:
            raise ImpactPlanError("recordings", "are empty: give at least one nominal run")
        times = [_labelled_impact(r) for r in recordings] if impact_s is None else [float(t) for t in impact_s]
        if len(times) != len(recordings):
            raise ImpactPlanError("impact_s", f"has {len(times)} times for {len(recordings)} recordings: give one each")
        since, values, poses = [], [], []
        for recording, t in zip(recordings, times, strict=True):
            if recording.q is None or recording.dq is None:
                raise ImpactPlanError("recordings", f"need q and dq, but {recording.source or 'one'} lacks one of them")
            rows = (recording.t > t + settle_s) & (recording.t <= t + span_s) & np.isfinite(recording.dq).all(axis=1)
            if rows.sum() <= degree or recording.n_joints != recordings[0].n_joints:
                problem = f"{rows.sum()} rows of {recording.n_joints} joints within {span_s:g} s after {t:g} s"
                raise ImpactPlanError("recordings", f"hold {problem}: give more rows, and of one arm")
            since.append(recording.t[rows] - t)
            values.append(recording.dq[rows])
            poses.append(recording.q[int(np.argmin(np.abs(recording.t - t)))])
        fit = np.polynomial.polynomial.polyfit(np.concatenate(since), np.concatenate(values), degree)  # (degree+1, n)
        t_d = float(np.median(times))
        grid = np.linspace(0.0, span_s, 2 if degree < 2 else 1 + round(span_s / 0.005))
        post_dq = np.vander(grid, degree + 1, increasing=True) @ np.asarray(fit, dtype=np.float64)  # (k, n)
        return cls(
            t_d,
            np.asarray(np.median(poses, axis=0), dtype=np.float64),
            t_d + grid,
            post_dq,
            window_s=window_s,
            contacts=tuple(contacts),
            source="recorded",
        )

    def save(self, path: str | Path) -> None:
        """Write the plan as a NumPy archive (`.npz`).

        Raises:
            ImpactPlanError: if the place cannot be written.
        """
        arrays: dict[str, ArrayLike] = {
            name: getattr(self, name) for name in _FIELDS if getattr(self, name) is not None
        }
        arrays["contact_link"] = np.array([contact.link for contact in self.contacts], dtype=np.int64)
        arrays["contact_point_m"] = np.array([c.point_m for c in self.contacts]).reshape(-1, 3)
        arrays["contact_normal"] = np.array([c.normal for c in self.contacts]).reshape(-1, 3)
        try:
            with Path(path).open("wb") as file:
                np.savez(file, allow_pickle=False, **arrays)
        except OSError as error:
            raise ImpactPlanError("file", f"{path} cannot be written: {error.strerror or error}") from None

    @classmethod
    def load(cls, path: str | Path) -> ImpactPlan:
        """Read a plan that `save` wrote.

        Raises:
            ImpactPlanError: if the file is missing, torn, or not a plan.
        """
        try:
            with Path(path).open("rb") as file, np.load(file, allow_pickle=False) as archive:
                arrays: dict[str, Any] = {name: archive[name] for name in archive.files}
        except OSError as error:
            raise ImpactPlanError("file", f"{path} cannot be read: {error.strerror or error}") from None
        except (ValueError, AttributeError, TypeError, EOFError, zipfile.BadZipFile):
            raise ImpactPlanError("file", f"{path} is not an impact plan: write one with ImpactPlan.save") from None
        try:
            links, points, normals = (arrays.pop(f"contact_{name}") for name in ("link", "point_m", "normal"))
            arrays["source"] = str(arrays["source"])
            contacts = tuple(ContactPoint(int(a), b, c) for a, b, c in zip(links, points, normals, strict=True))
            return cls(contacts=contacts, **arrays)
        except (KeyError, TypeError, ValueError):
            raise ImpactPlanError("file", f"{path} is not an impact plan: write one with ImpactPlan.save") from None


def _labelled_impact(recording: Recording) -> float:
    impacts = [label.start_s for label in recording.labels if label.kind.endswith("impact")]
    if not impacts:
        problem = "need the time of the impact: pass impact_s, or label it with the kind 'impact'"
        raise ImpactPlanError("recordings", f"{problem} ({recording.source or 'one'} has none)")
    return max(impacts)
