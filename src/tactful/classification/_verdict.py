"""What a classifier answers, and what a classifier is."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, Protocol

from tactful.classification._onset import Onset

Kind = Literal["contact", "collision", "cooperation", "expected_impact", "unexpected_impact"]


@dataclass(frozen=True, slots=True)
class Evidence:
    """Which rule decided, with its value and its threshold (None where there is none) and a sentence for people."""

    rule: str
    value: float | None
    threshold: float | None
    text: str


@dataclass(frozen=True, slots=True)
class Verdict:
    """The kind of a contact, how sure the classifier is (in [0, 1]) and why."""

    kind: Kind
    confidence: float
    evidence: tuple[Evidence, ...]


class Classifier(Protocol):
    """Tells what a contact is from the evidence at its beginning.

    It runs in the sample of the detection, outside the kernel; it keeps no state between contacts.
    """

    def classify(self, onset: Onset) -> Verdict:
        """Return what the contact is."""
        ...
