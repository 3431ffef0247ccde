"""The reactor: it follows a plan, and does what the policy says when a contact is told."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tactful.control import CartesianImpedance, MinimumJerkPath, Pose, minimum_jerk
from tactful.dynamics import Dynamics
from tactful.monitor import ContactEvent
from tactful.reaction._config import ReactionConfig, ReactionName
from tactful.reaction._reactions import Reaction, Stop, TaughtPath, Teach, giving_way, make
from tactful.reaction._trace import Trace
from tactful.robots import Robot

Array = NDArray[np.float64]
Plan = Callable[[float], Pose]
"""Where the tip is to be, by the time in the plan [s]; that time stands still while a reaction lasts."""

_FINISH_S = 0.5
"""In what time `finish` brings the plan to a stand [s]."""


class Reactor:
    """Command an arm along a plan and react to its contacts, in the sample in which they are told.

    In every sample: `react` with the event of the monitor, if there is one, then `torque`. The torque is that of a
    `CartesianImpedance` (gravity is not in it), limited to a share of the arm's limits and in its rate of change, also
    where one reaction follows another. After `comply` and `teach` the arm goes back to where it left its plan; after
    `stop` and `retract` it waits for `resume`, unless the policy sets a time.

    It lowers contact forces. It is not a certified safety function, and replaces none.

    Args:
        robot: the arm.
        plan: where the tip is to be.
        config: the policy.
        posture: posture for motion that leaves the tip at rest (n,) [rad], `robot.home` by default.
        merge: what becomes of the plan when a hand has taught a path: it gets the path and the plan and returns the
            plan to go on with, from the same time in it. By default the plan stays, and the path is kept in `taught`.

    Attributes:
        taught: the paths that hands have led.

    Raises:
        TactfulError: if the tip is fixed to the base, or the posture does not fit the arm.
    """

    def __init__(
        self,
        robot: Robot,
        plan: Plan,
        config: ReactionConfig | None = None,
        *,
        posture: ArrayLike | None = None,
        merge: Callable[[TaughtPath, Plan], Plan] | None = None,
    ) -> None:
        self.config = config = config or ReactionConfig()
        self.taught: list[TaughtPath] = []
        self._plan, self._merge = plan, merge
        impedance = config.impedance.model_copy(update={"torque_rate_nm_s": None})  # limited here, over all
        braking = config.braking.model_copy(update={"torque_rate_nm_s": None})
        self._moving = CartesianImpedance(robot, impedance, posture=posture)
        self._stiff = CartesianImpedance(robot, braking, posture=posture)
        self._soft = CartesianImpedance(robot, giving_way(impedance), posture=posture)
        self._dynamics = Dynamics(robot)
        self._limit = config.torque_share * robot.torque_limit  # (n,)
        self._rate_nm_s = config.torque_rate_nm_s
        self._tau = np.zeros(robot.n)
        self._t: float | None = None
        self._plan_s = 0.0
        self._reaction: Reaction | None = None
        self._way_back: tuple[float, MinimumJerkPath] | None = None
        self._contact: int | None = None
        self._ended_s: float | None = None
        self._waits = False
        self._finished_s: float | None = None
        self._trace = Trace()

    @property
    def reaction(self) -> ReactionName:
        """What the arm does now."""
        if self._reaction is None:
            return "continue" if self._finished_s is None else "stop"
        return self._reaction.name

    def warm_up(self) -> None:
        """Compile the kernels or load them compiled, so that the first sample does not wait for them."""
        self._moving.warm_up()
        self._dynamics.pose(self._dynamics.robot.home)

    def react(self, event: ContactEvent, t: float, q: ArrayLike) -> None:
        """Do what the policy says about an event that was told at the time t [s], with the joints at q (n,) [rad]."""
        if event.phase == "ended":
            if event.id == self._contact:
                self._ended_s = t
            return
        if self._reaction is None:
            self._trace.touch(event.onset_s, self._plan_s - (t - event.onset_s))
        name = self.config.choose(event)
        own = event.id == self._contact
        if name == "continue":
            if own and self._reaction is not None:
                self._go_back(t, q)
            return
        self._ended_s = None
        if own and name == self.reaction:
            return
        if not own and self._reaction is not None and not self._reaction.gives_way:
            self._waits = self.config.resume_s is None  # an earlier contact stopped the arm: this one does not free it
        led = isinstance(self._reaction, Teach)
        self._leave()
        self._contact = event.id
        tip = Pose(*self._dynamics.pose(q))
        self._reaction = make(name, t, tip, self._plan(self._plan_s), event, self.config)
        if isinstance(self._reaction, Teach) and not led:
            self._reaction.remember(self._trace.led())
        self._way_back = None

    def torque(self, t: float, q: ArrayLike, dq: ArrayLike) -> Array:
        """Return the torque to command (n,) [Nm], without gravity's.

        Args:
            t: time of the sample [s].
            q: joint positions (n,) [rad].
            dq: joint velocities (n,) [rad/s].

        Raises:
            TactfulError: if q or dq do not fit the arm, or are not finite.
        """
        step = 0.0 if self._t is None else min(max(t - self._t, 0.0), 0.1)
        if self._over(t):
            self._go_back(t, q)
        if self._trace.due(t):
            self._trace.note(t, Pose(*self._dynamics.pose(q)))
        reaction = self._reaction
        if reaction is None:
            reference = self._reference(t, step)
            wanted = self._moving.torque(q, dq, *reference)
            if self._finished_s is not None:
                done = minimum_jerk(self._finished_s / _FINISH_S)
                wanted = (1.0 - done) * wanted + done * self._stiff.torque(q, dq, *reference)
        else:
            if reaction.gives_way:
                reaction.notice(t, Pose(*self._dynamics.pose(q)))
            wanted = self._controller(reaction).torque(q, dq, *reaction.reference(t))
        wanted = np.minimum(np.maximum(wanted, -self._limit), self._limit)
        if self._t is not None:
            change = self._rate_nm_s * (step or self.config.impedance.period_s)
            wanted = np.minimum(np.maximum(wanted, self._tau - change), self._tau + change)
        self._t, self._tau = t, wanted
        return wanted

    def resume(self, t: float, q: ArrayLike) -> None:
        """Take up the plan where it was left; the way there takes `config.return_s`."""
        self._waits = False
        if self._reaction is not None:
            self._go_back(t, q)

    def follow(self, plan: Plan, t: float, q: ArrayLike) -> None:
        """Go on with another plan, from the same time in it; the way there takes `config.return_s`."""
        self._plan, self._trace = plan, Trace()
        if self._reaction is None:
            self._go_back(t, q)

    def finish(self, q: ArrayLike) -> None:
        """Come to a stand for good, without a jerk along the plan, or here where the arm has left it."""
        if self._reaction is None and self._way_back is None:
            self._finished_s = 0.0
        else:
            self.halt(q)

    def halt(self, q: ArrayLike) -> None:
        """Stop here, whatever there is."""
        self._leave()
        self._reaction, self._contact, self._ended_s = Stop(Pose(*self._dynamics.pose(q))), None, None

    def _controller(self, reaction: Reaction) -> CartesianImpedance:
        if not reaction.gives_way:
            return self._stiff
        return self._moving if isinstance(reaction, Teach) and reaction.held is not None else self._soft

    def _reference(self, t: float, step: float) -> Pose:
        if self._way_back is not None:
            end_s, path = self._way_back
            if t < end_s:
                return path.pose(t)
            self._way_back = None
        if self._finished_s is None:
            self._plan_s += step
        else:
            self._finished_s += step
            self._plan_s += step * (1.0 - minimum_jerk(self._finished_s / _FINISH_S))
        return self._plan(self._plan_s)

    def _over(self, t: float) -> bool:
        if self._reaction is None or self._ended_s is None:
            return False
        wait_s = self.config.release_s if self._reaction.gives_way else self.config.resume_s
        return wait_s is not None and t - self._ended_s >= wait_s

    def _leave(self) -> None:
        """Keep what the reaction that ends has learnt."""
        if isinstance(self._reaction, Teach):
            taught = self._reaction.taught(self._plan_s, self._trace.clear_s)
            self.taught.append(taught)
            if self._merge is not None:
                self._plan = self._merge(taught, self._plan)

    def _go_back(self, t: float, q: ArrayLike) -> None:
        if self._waits:
            self.halt(q)
            return
        self._leave()
        self._reaction, self._contact, self._ended_s = None, None, None
        here, there = Pose(*self._dynamics.pose(q)), self._plan(self._plan_s)
        end_s = t + self.config.return_s
        self._way_back = end_s, MinimumJerkPath([(t, here), (end_s, there)])
