"""What a classifier has to decide in labelled recordings."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Generic, Literal, TypeVar, cast

from tactful.classification import Evidence, Onset, Verdict
from tactful.evaluation import check_labels, label_at, operator_of
from tactful.learning._errors import LearningError
from tactful.monitor import Monitor, MonitorConfig
from tactful.recordings import Recording
from tactful.robots import Robot

T = TypeVar("T")
Truth = Literal["collision", "cooperation"]

KINDS = ("collision", "cooperation")


@dataclass(frozen=True, eq=False, kw_only=True)
class Decision(Generic[T]):
    """One detection, which a classifier has to tell.

    Attributes:
        truth: what the contact is that it belongs to.
        contact: the recording and the number of that contact in it.
        operator: who touched the arm, as far as the recording says.
        after_collision: whether a collision was there in the last second; then it may be that collision once more.
        asks: what was taken from the onset each time the classifier was asked.
    """

    truth: Truth
    contact: tuple[str, int]
    operator: str | None
    after_collision: bool
    asks: tuple[T, ...]


class _Oracle(Generic[T]):
    """A classifier that knows the truth, tells it when it is asked last, and notes what it could have seen."""

    def __init__(
        self, recording: Recording, operator: str | None, wait_s: float, extract: Callable[[Onset], T]
    ) -> None:
        self.decisions: list[Decision[T]] = []
        self._recording, self._operator, self._wait_s, self._extract = recording, operator, wait_s, extract
        self._asks: list[T] = []

    def classify(self, onset: Onset) -> Verdict:
        """Note what is known, and tell the truth when the time is over."""
        assert onset.detected_s is not None
        number = label_at(onset.detected_s, self._recording.labels)
        if number is None or self._recording.labels[number].kind not in KINDS:
            return Verdict("contact", 0.5, ())
        self._asks.append(self._extract(onset))
        if onset.next_s is not None and onset.next_s - onset.detected_s <= self._wait_s + 0.5 / onset.rate_hz:
            return Verdict("contact", 0.5, ())
        truth = cast(Truth, self._recording.labels[number].kind)
        answer = Verdict(truth, 1.0, (Evidence("truth", None, None, truth),))
        asks, self._asks = tuple(self._asks), []
        if self._unclear(onset.detected_s, number):
            return answer
        decision = Decision(
            truth=truth,
            contact=(self._recording.source, number),
            operator=self._operator,
            after_collision=onset.after_collision,
            asks=asks,
        )
        self.decisions.append(decision)
        return answer

    def _unclear(self, detected_s: float, number: int) -> bool:
        """Return whether nobody knows what changed: a hand and an obstacle are there, and the later one is found."""
        there = {label.kind for label in self._recording.labels if label.start_s <= detected_s <= label.end_s}
        found = any(decision.contact[1] == number for decision in self.decisions)
        return found and there >= set(KINDS)


def decisions_of(
    recording: Recording,
    robot: Robot | None,
    config: MonitorConfig,
    extract: Callable[[Onset], T],
    *,
    operator: str | None = None,
    wait_s: float = 0.07,
) -> tuple[Decision[T], ...]:
    """Run the monitor over a labelled recording, and return what its classifier has to decide there.

    The decisions before are taken as right: a monitor that called a collision cooperation sees nothing else until it is
    over. Detections that belong to no label, and contacts with another label than collision and cooperation, are left
    out; so are further ones while a hand and an obstacle are there, since the labels do not say which of them changed.

    Args:
        recording: with labels.
        robot: the arm.
        config: the settings of the monitor; `config.classifier` plays no role.
        extract: what is taken from each onset.
        operator: who touched the arm; by default what `operator_of` finds.
        wait_s: how long after a detection the classifier may wait [s].

    Raises:
        EvaluationError: if a label does not fit the recording.
        SampleError: if the recording does not fit the monitor.
    """
    check_labels(recording, links=robot.n if robot else None)
    oracle = _Oracle(recording, operator or operator_of(recording), wait_s, extract)
    Monitor(robot, config.fitted_to(recording.rate_hz), classifier=oracle).run(recording)
    return tuple(oracle.decisions)


def first_of_each(decisions: Sequence[Decision[T]]) -> list[Decision[T]]:
    """Return the decision that finds each contact: the first one of those that belong to it.

    Raises:
        LearningError: if a kind does not occur.
    """
    first: dict[tuple[str, int], Decision[T]] = {}
    for decision in decisions:
        first.setdefault(decision.contact, decision)
    found = list(first.values())
    for kind in KINDS:
        if not any(decision.truth == kind for decision in found):
            raise LearningError(f"the recordings have no {kind} that the monitor detected: label some, of both kinds")
    return found
