"""The robot arm as data."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from types import MappingProxyType
from typing import Literal, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tactful.robots._errors import RobotError, UnknownFrameError, UnknownRobotError
from tactful.robots._frozen import Array, FrozenRecord, frozen_array
from tactful.robots._geometry import Capsule, Frame, is_rotation
from tactful.robots._inertia import inertia_problem, joined_inertia

_SHAPES: Mapping[str, tuple[int, ...]] = MappingProxyType(
    {
        "prismatic": (),
        "rotation": (3, 3),
        "translation": (3,),
        "axis": (3,),
        "mass": (),
        "com": (3,),
        "inertia": (3, 3),
        "lower": (),
        "upper": (),
        "velocity_limit": (),
        "torque_limit": (),
        "motor_inertia": (),
        "stiffness": (),
        "damping": (),
        "coulomb_friction": (),
        "viscous_friction": (),
        "home": (),
    }
)
_MAY_BE_INFINITE = ("lower", "upper", "velocity_limit", "torque_limit")
_MAY_BE_NAN = ("stiffness", "damping")
_NOT_NEGATIVE = (
    "velocity_limit",
    "torque_limit",
    "motor_inertia",
    "coulomb_friction",
    "viscous_friction",
    *_MAY_BE_NAN,
)


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class Robot(FrozenRecord):
    """A serial arm of n joints: its kinematic and inertial figures, limits and frames. Immutable.

    Link i moves with joint i, and its frame's origin lies on the axis of joint i. Its pose in link i-1 (the base for
    i = 0) is T_i Rot(axis[i], q_i) for a revolute joint and T_i Trans(axis[i] q_i) for a prismatic one, with
    T_i = (rotation[i], translation[i]). `dataclasses.replace` makes a changed copy, which is checked again.

    Attributes:
        name: Short name, as in `Robot.load`.
        title: Manufacturer and model.
        source: Where the figures come from.
        joint_names: n names.
        link_names: n names; link i moves with joint i.
        prismatic: (n,) bool.
        rotation: (n, 3, 3) of link i in link i-1 at q_i = 0.
        translation: (n, 3) [m] of link i in link i-1 at q_i = 0.
        axis: (n, 3) unit vectors, in the link's frame.
        mass: (n,) [kg].
        com: (n, 3) [m] centre of mass in the link's frame.
        inertia: (n, 3, 3) [kg m^2] about the centre of mass, axes of the link's frame.
        lower: (n,) [rad or m] position limits, -inf where unknown or unlimited.
        upper: (n,) [rad or m], +inf where unknown or unlimited.
        velocity_limit: (n,) [rad/s or m/s], inf where unknown.
        torque_limit: (n,) [Nm or N], inf where unknown.
        motor_inertia: (n,) [kg m^2 or kg] of the rotors, reflected to the links; 0 where unknown.
        stiffness: (n,) [Nm/rad or N/m] of the elastic joints, nan where unknown.
        damping: (n,) [Nms/rad or Ns/m] of the elastic joints, nan where unknown.
        coulomb_friction: (n,) [Nm or N], 0 where unknown.
        viscous_friction: (n,) [Nms/rad or Ns/m], 0 where unknown.
        torque_sensor: Where the joint torque is measured: behind the gear (`link`) or by the motor current (`motor`).
        home: (n,) [rad or m] a usual working pose.
        frames: Frames by name.
        tip: Name of the frame at which forces are reported.
        gravity: (3,) [m/s^2] in the base frame.
        capsules: Surface of the links, empty where unknown.
        reach_m: [m] reach that the manufacturer states, nan where unknown.

    Raises:
        RobotError: A figure has the wrong shape or cannot be physical.
    """

    name: str
    title: str
    source: str
    joint_names: tuple[str, ...]
    link_names: tuple[str, ...]
    prismatic: NDArray[np.bool_]
    rotation: Array
    translation: Array
    axis: Array
    mass: Array
    com: Array
    inertia: Array
    lower: Array
    upper: Array
    velocity_limit: Array
    torque_limit: Array
    motor_inertia: Array
    stiffness: Array
    damping: Array
    coulomb_friction: Array
    viscous_friction: Array
    torque_sensor: Literal["link", "motor"]
    home: Array
    frames: Mapping[str, Frame]
    tip: str
    gravity: Array = field(default_factory=lambda: np.array([0.0, 0.0, -9.81]))
    capsules: tuple[Capsule, ...] = ()
    reach_m: float = float("nan")

    def __post_init__(self) -> None:
        n = len(self.joint_names)
        if n == 0:
            raise RobotError(self.name, "joint_names", "is empty: a robot has at least one moving joint")
        for name, shape in _SHAPES.items():
            self._freeze(name, (n, *shape), np.bool_ if name == "prismatic" else np.float64)
        self._freeze("gravity", (3,), np.float64)
        object.__setattr__(self, "joint_names", tuple(self.joint_names))
        object.__setattr__(self, "link_names", tuple(self.link_names))
        object.__setattr__(self, "frames", MappingProxyType(dict(self.frames)))
        object.__setattr__(self, "capsules", tuple(self.capsules))
        self._check()

    def _freeze(self, name: str, shape: tuple[int, ...], dtype: type[np.generic]) -> None:
        try:
            array = frozen_array(getattr(self, name), dtype)
        except (TypeError, ValueError) as error:
            raise RobotError(self.name, name, f"must be numbers of shape {shape}: {error}") from None
        if array.shape != shape:
            raise RobotError(self.name, name, f"must have the shape {shape}, not {array.shape}")
        bad = np.isnan(array) if name in _MAY_BE_INFINITE else ~np.isfinite(array) & (name not in _MAY_BE_NAN)
        if bad.any():
            raise RobotError(self.name, name, f"must be finite, not {array[bad][0]}")
        if name in _NOT_NEGATIVE and (array < 0).any():
            raise RobotError(self.name, name, f"must not be negative, but is {array.tolist()}")
        object.__setattr__(self, name, array)

    def _check(self) -> None:
        n = self.n
        if len(self.link_names) != n:
            raise RobotError(self.name, "link_names", f"must be {n} names, one a joint, not {len(self.link_names)}")
        for names in ("joint_names", "link_names"):
            if len(set(getattr(self, names))) != n:
                raise RobotError(self.name, names, f"must differ from each other: {', '.join(getattr(self, names))}")
        if not is_rotation(self.rotation):
            raise RobotError(self.name, "rotation", "must be orthonormal, right-handed matrices")
        norm = np.linalg.norm(self.axis, axis=1)  # (n,)
        if (np.abs(norm - 1) > 1e-9).any():
            raise RobotError(self.name, "axis", f"must be unit vectors, but their norms are {norm.round(6).tolist()}")
        for i, link in enumerate(self.link_names):
            if self.mass[i] <= 0:
                raise RobotError(self.name, "mass", f"of link {link!r} must be positive, not {self.mass[i]:g} kg")
            if problem := inertia_problem(self.inertia[i]):
                raise RobotError(self.name, "inertia", f"of link {link!r} {problem}")
            if self.lower[i] > self.upper[i]:
                raise RobotError(
                    self.name,
                    "lower",
                    f"limit of {self.joint_names[i]!r} is above the upper one: {self.lower[i]:g} > {self.upper[i]:g}",
                )
        if ((self.home < self.lower - 1e-9) | (self.home > self.upper + 1e-9)).any():
            raise RobotError(self.name, "home", f"lies outside the joint limits: {self.home.round(4).tolist()}")
        if self.torque_sensor not in ("link", "motor"):
            raise RobotError(self.name, "torque_sensor", f"must be 'link' or 'motor', not {self.torque_sensor!r}")
        for field_name, links in (
            ("frames", [frame.link for frame in self.frames.values()]),
            ("capsules", [capsule.link for capsule in self.capsules]),
        ):
            if beyond := [link for link in links if not -1 <= link < n]:
                raise RobotError(self.name, field_name, f"lie on link {beyond[0]}, but links are -1 (base) to {n - 1}")
        if self.tip not in self.frames:
            raise UnknownFrameError(self.name, self.tip, self.frames)

    def __repr__(self) -> str:
        return f"Robot({self.name!r}, {self.n} joints, {self.mass.sum():.1f} kg, tip={self.tip!r})"

    @property
    def n(self) -> int:
        """Number of joints."""
        return len(self.joint_names)

    @staticmethod
    def names() -> tuple[str, ...]:
        """Names of the built-in robots."""
        from tactful.robots._builtin import builtin_names

        return builtin_names()

    @staticmethod
    def load(name_or_path: str | Path, *, tip: str | None = None) -> Robot:
        """Load a built-in robot by name, or any serial arm from an MJCF or URDF file.

        Files need the extra `mujoco`. The base frame of such a robot is the body that carries the first joint.
        Fixed links are lumped into the link that carries them; joints off the chain are locked where the file draws
        them.

        Args:
            name_or_path: A name from `Robot.names()`, or the path of a file (`.xml`, `.mjcf`, `.urdf`).
            tip: Frame at which forces are reported; of a file: any site or link, whose chain to the base becomes the
                robot. Default: what the built-in robot declares; of a file a site or link called `tip` or
                `attachment_site`, else the last link of the longest chain.

        Raises:
            UnknownRobotError: Nothing is called like that.
            UnknownFrameError: The robot has no such frame.
            RobotFileError: The file is missing, torn, or not a serial arm.
        """
        if Path(name_or_path).suffix.lower() in (".xml", ".mjcf", ".urdf"):
            from tactful.robots._file import load_file

            return load_file(Path(name_or_path), tip)
        from tactful.robots._builtin import builtin_names, load_builtin

        if str(name_or_path) not in builtin_names():
            raise UnknownRobotError(str(name_or_path), builtin_names())
        robot = load_builtin(str(name_or_path))
        return robot if tip is None else robot.with_tip(tip)

    def with_tip(self, name: str) -> Self:
        """The same arm, its forces reported at the frame `name`.

        Raises:
            UnknownFrameError: The robot has no such frame.
        """
        return replace(self, tip=name)

    def with_gravity(self, vector: ArrayLike) -> Self:
        """The same arm mounted otherwise: `vector` (3,) [m/s^2] is gravity in the base frame."""
        return replace(self, gravity=np.asarray(vector, dtype=np.float64))

    def with_payload(
        self, mass_kg: float, com_m: ArrayLike, inertia_kg_m2: ArrayLike | None = None, *, frame: str | None = None
    ) -> Self:
        """The same arm with a tool or load fixed to it, lumped into the link that carries it.

        Args:
            mass_kg: Mass of the payload [kg].
            com_m: (3,) [m] its centre of mass in `frame`.
            inertia_kg_m2: (3, 3) [kg m^2] about its centre of mass, axes of `frame`; None is a point mass.
            frame: Name of the frame, by default the tip.

        Raises:
            UnknownFrameError: The robot has no such frame.
            RobotError: The payload cannot be physical, or the frame is on the base.
        """
        name = self.tip if frame is None else frame
        if name not in self.frames:
            raise UnknownFrameError(self.name, name, self.frames)
        at = self.frames[name]
        com = np.asarray(com_m, dtype=np.float64)  # (3,)
        inertia = np.zeros((3, 3)) if inertia_kg_m2 is None else np.asarray(inertia_kg_m2, dtype=np.float64)  # (3, 3)
        if at.link < 0:
            raise RobotError(self.name, "payload", f"hangs on {name!r}, which is fixed to the base and never moves")
        if not (np.isfinite(mass_kg) and mass_kg > 0):
            raise RobotError(self.name, "payload", f"must have a positive mass, not {mass_kg} kg")
        if com.shape != (3,) or not np.isfinite(com).all():
            raise RobotError(self.name, "payload", f"needs a centre of mass of 3 finite numbers, not {com.tolist()}")
        if inertia.shape != (3, 3):
            raise RobotError(self.name, "payload", f"needs an inertia of shape (3, 3), not {inertia.shape}")
        if problem := inertia_problem(inertia, allow_zero=True):
            raise RobotError(self.name, "payload", f"inertia {problem}")
        masses, coms, inertias = self.mass.copy(), self.com.copy(), self.inertia.copy()
        masses[at.link], coms[at.link], inertias[at.link] = joined_inertia(
            self.mass[at.link],
            self.com[at.link],
            self.inertia[at.link],
            mass_kg,
            at.rotation @ com + at.translation,
            at.rotation @ inertia @ at.rotation.T,
        )
        return replace(self, mass=masses, com=coms, inertia=inertias)

    def to_mjcf(self) -> str:
        """The arm as an MJCF document for MuJoCo: links, joints, full inertias, frames as sites, capsules as geoms.

        Joint elasticity is not written, nor are velocity limits, which MJCF does not know.
        """
        from tactful.robots._mjcf import to_mjcf

        return to_mjcf(self)
