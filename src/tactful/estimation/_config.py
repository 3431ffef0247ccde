"""Settings of the estimation of external torque and wrench."""

from __future__ import annotations

from typing import Literal

from pydantic import NonNegativeFloat, PositiveFloat

from tactful.config import Config

PerJoint = float | tuple[float, ...]
"""One number for all joints, or one for each."""


class ObserverConfig(Config):
    """The generalized momentum observer, see `MomentumObserver`."""

    bandwidth_hz: PositiveFloat | tuple[PositiveFloat, ...] = 30.0
    """Cut-off frequency of r as an estimate of tau_ext, K_O / (2 pi); one for all joints or one each [Hz]."""
    integration: Literal["trapezoid", "euler"] = "trapezoid"
    """Rule for the integral. The choice changes r by up to 0.65 Nm in fast motion; "euler" is what most published codes
    use, and diverges at a bandwidth above rate / pi."""
    joint_flexibility: bool = False
    """Whether the term D K^-1 dtau_J/dt of an elastic joint is used; needs `stiffness` and `damping` of the robot."""
    bias_nm: PerJoint = 0.0
    """Offset of the torque sensors, subtracted from tau [Nm]."""
    coulomb_nm: NonNegativeFloat | tuple[NonNegativeFloat, ...] = 0.0
    """Coulomb friction that the measured torque still contains, subtracted as coulomb_nm tanh(dq / coulomb_speed_rad_s)
    [Nm]."""
    viscous_nms: NonNegativeFloat | tuple[NonNegativeFloat, ...] = 0.0
    """Viscous friction that the measured torque still contains [Nms]."""
    coulomb_speed_rad_s: PositiveFloat = 0.02
    """Speed at which the smooth Coulomb friction has 76 % of its value [rad/s]."""
    hysteresis_rad: NonNegativeFloat | tuple[NonNegativeFloat, ...] = 0.0
    """Displacement over which the Coulomb friction is taken up after a reversal: coulomb_nm z with
    dz = (dq dt - z |dq dt|) / hysteresis_rad, the model of P. Dahl (Aerospace Corp. TOR-158, 1968). 0 takes the tanh of
    the speed instead [rad]."""
    velocity: Literal["measured", "position"] = "measured"
    """What the momentum is computed from: the measured velocity, or the slope of the position over
    `velocity_window_s`. The slope has a tenth of the noise on a Franka arm, whose measured velocity also lags by 5 ms;
    it needs finely resolved positions and exact time, see `clock_s`."""
    velocity_window_s: PositiveFloat = 0.005
    """Length of the window of the slope, at most 63 samples; half of it is the lag of the velocity. Torque and pose are
    taken with the same lag: a torque that is ahead of the velocity is a contact in each jerk [s]."""
    clock_s: PositiveFloat | None = None
    """Period of the robot's own clock. Where it is given, the time of a sample is a whole number of periods, told by
    position and velocity while the arm moves, and samples that came twice are left out; for stamps of a host that
    jitter. None takes the stamps as they are [s]."""


class WrenchConfig(Config):
    """The wrench at the tip that explains the external torque, see `external_wrench`."""

    damped_below: NonNegativeFloat = 0.03
    """Bound on the smallest singular value of the Jacobian below which the solution is damped; 0 never damps."""
    damping: PositiveFloat = 0.03
    """Largest damping factor lambda, reached where the Jacobian is singular."""
