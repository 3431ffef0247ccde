"""The contact monitor."""

from __future__ import annotations

import copy
import functools
from collections.abc import Callable
from typing import Any, Self

import numpy as np
from numba import typeof
from numpy.typing import ArrayLike, NDArray

from tactful.classification import AimAwareResult, Classifier, ImpactCause, ImpactCauses
from tactful.config import ConfigError
from tactful.detection.contact_state import NOTHING
from tactful.errors import TactfulError
from tactful.impacts import ImpactPlan
from tactful.monitor import _kernel, _planned_kernel
from tactful.monitor._config import MonitorConfig, Source
from tactful.monitor._contacts import Contacts
from tactful.monitor._event import ContactEvent
from tactful.monitor._locator import Locator
from tactful.monitor._memory import Memory
from tactful.monitor._planned import Planned
from tactful.monitor._timeline import Health, Timeline
from tactful.recordings import Recording
from tactful.robots import Robot

_SOURCES: dict[Source, int] = {"tau": _kernel.TAU, "tau_ext": _kernel.TAU_EXT, "wrench": _kernel.WRENCH}
_BLOCK = 100_000
_TUNABLE: Any = {"fast": {"threshold"}, "frequency": {"threshold_n"}, "provenance": True}


class SampleError(TactfulError):
    """A sample or a recording that does not fit the monitor."""


class Monitor:
    """Tell from joint sensors when an arm is touched, how hard, and what the touch is.

    Each sample goes through one kernel: external joint torque (`MomentumObserver`), wrench at the tip
    (`external_wrench`), its level in a frequency band (`SlidingDFT`), and the states of a contact (`ContactConfig`).
    When a contact is detected, the classifier says what it is from the second before. `update` takes one sample, `run`
    a recording; `run` is `update` over the rows, bit for bit.

    A bad sample (a value that is not finite, time that does not advance) is counted and skipped; after a gap in time
    the monitor starts anew. It is `degraded` for a second after either. It can be copied and pickled while it runs.

    Args:
        robot: the arm; by default the one that the configuration names, if any. Without one, it takes wrenches alone.
        config: the settings.
        classifier: what tells the kind of a contact; by default `config.load_classifier()`.
        plan: an impact that is intended, see `expect`.
        causes: what tells what went wrong with it; None leaves it at which condition was violated.

    Raises:
        ConfigError, BandError: if a setting does not fit the robot or the rate.

    Example:
        >>> import numpy as np
        >>> from tactful import Monitor, Robot
        >>> panda = Robot.load("panda")
        >>> monitor = Monitor(panda)
        >>> monitor.update(0.0, q=panda.home, dq=np.zeros(7), tau=np.zeros(7)) is None
        True
    """

    def __init__(
        self,
        robot: Robot | None = None,
        config: MonitorConfig | None = None,
        *,
        classifier: Classifier | None = None,
        plan: ImpactPlan | None = None,
        causes: ImpactCauses | None = None,
    ) -> None:
        self.config = config or MonitorConfig()
        self.robot = robot = robot or self.config.robot.load()
        self.classifier = classifier or self.config.load_classifier()
        self.causes = causes
        self._source: Source | None = None
        self._channels: tuple[str, ...] = ()
        self._begin(Memory(robot, self.config, wrench=robot is None or self.config.source == "wrench"))
        self.expect(plan)

    def _begin(self, memory: Memory) -> None:
        self._memory = memory
        robot = self.robot
        located = robot is not None and memory.of_joints and any(c.link >= 0 for c in robot.capsules)
        self._locator = Locator(robot, memory, self.config) if robot is not None and located else None
        self._contacts = Contacts(memory, self.config, self.classifier, self._locator)
        self._bind()

    def _bind(self) -> None:
        """Keep what `update` needs in every sample at hand."""
        self._arrays = self._memory.arrays
        self._t = self._memory.sample["t"]
        self._views = self._channel_views()
        self._step: Callable[[], int] = self._first_step

    def _channel_views(self) -> tuple[tuple[int, int, NDArray[np.float64]], ...]:
        sample = self._memory.sample[0]
        fields = (("q", "q"), ("dq", "dq"), ("tau", "tau"), ("tau_ext", "tau"), ("wrench", "wrench"))
        return tuple(
            (i, len(sample[field]), sample[field])
            for i, (channel, field) in enumerate(fields)
            if channel in self._channels
        )

    def _first_step(self) -> int:
        self._find_kernel()
        return self._step()

    def _find_kernel(self) -> None:
        """Look for the compiled kernel once: numba's own call would do so in every sample, as long as it computes."""
        types = tuple(typeof(array) for array in self._arrays)
        _kernel.update.compile(types)
        self._step = functools.partial(_kernel.update.overloads[types].entry_point, *self._arrays)

    def __copy__(self) -> Self:
        """Return a monitor of its own that goes on from here."""
        return copy.deepcopy(self)

    def __getstate__(self) -> dict[str, Any]:
        """Leave out the views into the memory."""
        views = ("_arrays", "_views", "_t", "_step")
        return {key: value for key, value in self.__dict__.items() if key not in views}

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Make new views into the memory."""
        self.__dict__.update(state)
        self._bind()

    @property
    def health(self) -> Health:
        """How good the samples were so far."""
        record = self._memory.record[0]
        return Health(**{key: int(record[key]) for key in ("samples", "nonfinite", "backward", "gaps", "repeated")})

    @property
    def degraded(self) -> bool:
        """Whether a sample of the last second was bad."""
        record = self._memory.record[0]
        return bool(record["last_bad"] >= 0 and record["samples"] - record["last_bad"] < self.config.rate_hz)

    @property
    def ready(self) -> bool:
        """Whether enough samples have come since the last start that a contact can be detected."""
        record = self._memory.record[0]
        return bool(record["since_start"] >= record["warm_up"])

    @property
    def bias_nm(self) -> tuple[float, ...]:
        """Bias of the external torque (or wrench) that is followed and taken out, see `FastConfig.bias_s` [Nm]."""
        return tuple(self._memory.record["bias"][0].tolist())

    @property
    def contact(self) -> ContactEvent | None:
        """The contact that is there now."""
        current = self._contacts.current
        return current if current is None or self._planned is None else self._planned.rephrase(current)

    @property
    def impact(self) -> AimAwareResult | None:
        """What is known of the planned impact; None until it came or was missed."""
        return None if self._planned is None else self._planned.result

    @property
    def impact_cause(self) -> ImpactCause | None:
        """What went wrong with the planned impact; None without a verdict, or where nothing tells causes."""
        return None if self._planned is None else self._planned.cause

    def recent(self, count: int) -> Any:
        """Return the last `count` rows, the newest last, with the fields of `Timeline.trace`; a second at most.

        Another thread may ask, if it asks for less than the second: the oldest rows are being overwritten.
        """
        return self._memory.recent(count)

    def retune(self, config: MonitorConfig) -> None:
        """Take other thresholds from the next sample on; all else that is known stays.

        Raises:
            ConfigError: if anything but `fast.threshold`, `frequency.threshold_n` and the provenance differs.
        """
        same = self.config.model_dump(exclude=_TUNABLE) == config.model_dump(exclude=_TUNABLE)
        if not same:
            raise ConfigError("monitor", "", "only thresholds can change while it runs; make another monitor")
        self._memory.retune(config)
        self.config = config

    def expect(self, plan: ImpactPlan | None) -> None:
        """Take a planned impact in the place of the one before; None expects none.

        Within the plan's window an impact is told as `expected_impact` or `unexpected_impact`, see `AimAware`: first
        what the conditions at the time of impact say, after the time xi the verdict. All else, and what comes before
        the window, is a contact as always. Give the plan well before its window begins.

        Raises:
            ConfigError: if a setting does not fit the plan.
            SampleError: if the plan is for another number of joints, or the samples do not hold what it needs.
        """
        self._plan = plan
        self._planned = None
        if plan is None:
            return
        if self.robot is None or plan.n != self.robot.n:
            arm = "no robot" if self.robot is None else f"{self.robot.name}, which has {self.robot.n}"
            raise SampleError(f"the plan is for {plan.n} joints, but the monitor has {arm}")
        observed = self._source in (None, "tau")
        planned = Planned(self.robot, plan, self.config, observed=observed, causes=self.causes)
        if self._source is not None and (self._source == "wrench" or "dq" not in self._channels):
            raise SampleError(
                f"a planned impact needs q, dq and tau or tau_ext, but the monitor hears {', '.join(self._channels)}"
            )
        self._planned = planned

    def update(
        self,
        t: float,
        q: ArrayLike | None = None,
        dq: ArrayLike | None = None,
        tau: ArrayLike | None = None,
        *,
        tau_ext: ArrayLike | None = None,
        wrench: ArrayLike | None = None,
    ) -> ContactEvent | None:
        """Take one sample and return the contact that began, changed or ended with it.

        Args:
            t: time [s].
            q: joint positions (n,) [rad].
            dq: joint velocities (n,) [rad/s].
            tau: measured joint torque, gravity included (n,) [Nm].
            tau_ext: external joint torque as the robot estimates it (n,) [Nm], where there is no `tau`.
            wrench: external wrench at the tip, base axes (6,) [N, Nm], where there is no torque at all.

        Raises:
            SampleError: if the channels are not those of the first sample, or have a wrong length.
        """
        if self._source is None:
            given = {"q": q, "dq": dq, "tau": tau, "tau_ext": tau_ext, "wrench": wrench}
            self._listen(tuple(name for name, value in given.items() if value is not None))
        try:
            self._t[0] = t
            values = (q, dq, tau, tau_ext, wrench)
            for i, width, view in self._views:
                value = values[i]
                if len(value) != width:  # type: ignore[arg-type]
                    raise ValueError
                view[...] = value
        except (TypeError, ValueError):
            raise self._misfit(q=q, dq=dq, tau=tau, tau_ext=tau_ext, wrench=wrench) from None
        code = self._step()
        contacts = self._contacts
        if code == NOTHING or code == _kernel.SKIPPED:
            event = contacts.waiting.popleft() if contacts.waiting else None
        else:
            event = contacts.react(code)
        if self._planned is None:
            return event
        news = self._planned.take(self._memory)
        return self._planned.tell(event, news, self._contacts, self._memory)

    def run(
        self,
        recording: Recording,
        *,
        trace: bool = False,
        progress: Callable[[int], None] | None = None,
    ) -> Timeline:
        """Take all samples of a recording and return the contacts in it.

        The monitor goes on where it is: for another recording, take another monitor.

        Args:
            recording: what was recorded; its rate has to be that of the configuration, within 5 %.
            trace: whether to keep forces, levels and states of all samples, which `Timeline.plot` needs.
            progress: called with the number of samples taken, every 100 000 samples and at the end.

        Raises:
            SampleError: if the recording lacks a channel, or has another rate or number of joints.
        """
        rows = self.accept(recording)
        t = rows[0]
        traced: Any = np.empty(len(t) if trace else 0, self._memory.row_dtype)
        latest: dict[int, ContactEvent] = {}
        k, ahead, news = 0, 0, _planned_kernel.NOTHING
        planned = self._planned
        while k < len(t):
            stop = len(t) if progress is None else min(len(t), (k // _BLOCK + 1) * _BLOCK)
            if self._contacts.waiting:
                stop = k + 1
            if planned is not None:
                if ahead <= k:
                    ahead, news = planned.run(rows, k, stop)
                stop = min(stop, ahead)
            k, code = _kernel.run(*self._arrays, *rows, k, stop, traced)
            event = self._contacts.next() if code == NOTHING else self._contacts.react(code)
            if planned is not None:
                brought = news if k == ahead else _planned_kernel.NOTHING
                event = planned.tell(event, brought, self._contacts, self._memory)
            if event is not None:
                latest[event.id] = event
                if trace:
                    traced["state"][k - 1] = self._contacts.state
            if progress is not None and (k % _BLOCK == 0 or k == len(t)):
                progress(k)
        for event in self._contacts.open():
            latest[event.id] = event if planned is None else planned.rephrase(event)
        good = t[np.isfinite(t)]
        return Timeline(
            events=tuple(latest[number] for number in sorted(latest)),
            health=self.health,
            config=self.config,
            robot=self.robot.name if self.robot else None,
            source=recording.source,
            start_s=float(good[0]) if len(good) else float("nan"),
            end_s=float(good[-1]) if len(good) else float("nan"),
            bias_nm=self.bias_nm,
            bias_limit_nm=tuple(self._memory.record["bias_limit"][0].tolist()),
            trace=traced if trace else None,
        )

    def accept(self, recording: Recording) -> tuple[NDArray[np.float64], ...]:
        """Check that a recording can be monitored, and return t, q, dq, torque and wrench as the kernel takes them.

        Channels that are not needed have no rows.

        Raises:
            SampleError: if the recording lacks a channel, or has another rate or number of joints.
        """
        rate_hz = recording.rate_hz
        if not abs(rate_hz / self.config.rate_hz - 1) <= 0.05:
            raise SampleError(
                f"{recording.source}: sampled at {rate_hz:.4g} Hz, the monitor is set to {self.config.rate_hz:g} Hz; "
                f"use config.fitted_to(recording.rate_hz), or set rate_hz"
            )
        if self._source is None:
            self._listen(tuple(recording.channels))
        return self._rows(recording)

    def warm_up(self, *, stream: bool = True) -> bool:
        """Compile the kernels or load them compiled, without taking a sample; return whether they had to be compiled.

        The first monitor ever for a number of joints compiles for about half a minute, later ones load the result. Call
        it before a loop that must not wait; without `stream`, what `update` alone needs and what locates a contact is
        left for later.
        """
        empty = [
            _readonly(np.empty(0)),
            *(_readonly(np.empty((0, width))) for width in (*(max(self._memory.n, 1),) * 3, 6)),
        ]
        misses = [sum(kernel.stats.cache_misses.values()) for kernel in (_kernel.run, _kernel.update)]
        _kernel.run(*self._arrays, *empty, 0, 0, np.empty(0, self._memory.row_dtype))
        if stream:
            self._find_kernel()
            if self._locator is not None:
                self._locator.warm_up()
        return misses != [sum(kernel.stats.cache_misses.values()) for kernel in (_kernel.run, _kernel.update)]

    def _listen(self, given: tuple[str, ...]) -> None:
        """Choose the source of the force from the channels that are there."""
        wanted = self.config.source
        possible: tuple[Source, ...] = ("tau", "tau_ext", "wrench") if wanted == "auto" else (wanted,)
        needs: dict[Source, tuple[str, ...]] = {
            "tau": ("q", "dq", "tau"),
            "tau_ext": ("q", "tau_ext"),
            "wrench": ("wrench",),
        }
        arm = self.robot is not None
        for source in possible:
            if all(channel in given for channel in needs[source]) and (arm or source == "wrench"):
                break
        else:
            lacking = "; ".join(
                f"{source} needs {', '.join(needs[source])}" + ("" if arm or source == "wrench" else " and a robot")
                for source in possible
            )
            raise SampleError(f"no external force can be estimated from {', '.join(given) or 'nothing'}: {lacking}")
        if source == "wrench" and arm:
            self._begin(Memory(self.robot, self.config, wrench=True))
        motion = tuple(channel for channel in ("q", "dq") if arm and channel in given)
        self._source = source
        self._channels = (*(motion if "q" in motion else ()), source)
        sample = self._memory.sample[0]
        sample["source"] = _SOURCES[source]
        sample["has_q"] = "q" in self._channels
        sample["has_dq"] = "dq" in self._channels
        self.expect(self._plan)
        self._views = self._channel_views()

    def _rows(self, recording: Recording) -> tuple[NDArray[np.float64], ...]:
        """Return t, q, dq, tau and wrench as the kernel takes them, with no rows where they are not needed."""
        n = self._memory.n

        def channel(name: str, width: int) -> NDArray[np.float64]:
            if name not in self._channels:
                return _readonly(np.empty((0, max(width, 1))))
            values = recording.channels.get(name)
            if values is None:
                raise SampleError(f"{recording.source}: has no channel {name}, which the monitor listens to")
            if values.shape[1] != width:
                raise SampleError(
                    f"{recording.source}: {name} has {values.shape[1]} columns, but "
                    f"{self.robot.name if self.robot else 'a wrench'} has {width}; choose the robot that was recorded"
                )
            return _readonly(values)

        torque = "tau_ext" if self._source == "tau_ext" else "tau"
        return _readonly(recording.t), channel("q", n), channel("dq", n), channel(torque, n), channel("wrench", 6)

    def _misfit(self, **given: ArrayLike | None) -> SampleError:
        for name in self._channels:
            width = 6 if name == "wrench" else self._memory.n
            value = given[name]
            if value is None:
                return SampleError(f"sample without {name}, which was there in the first sample")
            length = np.size(value)
            if length != width:
                return SampleError(f"{name} has {length} numbers, but {width} are needed")
        return SampleError("the sample has values that are not numbers")


def _readonly(array: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return a contiguous read-only view, so that numba sees one type whatever the recording's arrays are."""
    view = np.ascontiguousarray(array, dtype=np.float64).view()
    view.flags.writeable = False
    return view
