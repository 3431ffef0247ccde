"""The truth that events are held against."""

from __future__ import annotations

from difflib import get_close_matches
from typing import get_args

import numpy as np

from tactful.classification import Kind
from tactful.evaluation._errors import EvaluationError
from tactful.recordings import Label, Recording

EVENT_KINDS: tuple[str, ...] = get_args(Kind)
LABEL_KINDS = (*EVENT_KINDS, "impact", "push")
"""What a label may say. `contact`, `impact` and `push` say that there was one, not what the monitor should call it."""

VISIBLE_N = 1.0
"""The force from which a contact can be expected to be seen [N]."""

_SLACK_S = 0.1
"""How far a label may reach beyond the rows: hand-made ones are rounded [s]."""


def tells_kind(label: Label) -> bool:
    """Whether a label says what the monitor should call the contact."""
    return label.kind in EVENT_KINDS and label.kind != "contact"


def check_labels(recording: Recording, *, links: int | None = None) -> None:
    """Check that the labels of a recording can be its truth.

    Args:
        recording: what is to be evaluated.
        links: number of links of the arm, where known.

    Raises:
        EvaluationError: a label has a kind that no event has, lies outside the recording, or on a link that is not.
    """
    first_s, last_s = float(np.nanmin(recording.t)), float(np.nanmax(recording.t))
    for label in recording.labels:
        where = f"label {label.kind!r} from {label.start_s:g} to {label.end_s:g} s"
        if label.kind not in LABEL_KINDS:
            near = get_close_matches(label.kind.casefold(), LABEL_KINDS, n=1, cutoff=0.6)
            hint = f"did you mean {near[0]!r}?" if near else f"use one of {', '.join(LABEL_KINDS)}"
            raise EvaluationError(f"{where}: unknown kind; {hint}", source=recording.source)
        if label.start_s < first_s - _SLACK_S or label.end_s > last_s + _SLACK_S:
            raise EvaluationError(
                f"{where} lies outside the recording, which spans {first_s:g} to {last_s:g} s: "
                "labels are in seconds on the clock of the recording",
                source=recording.source,
            )
        if links is not None and label.link is not None and label.link >= links:
            raise EvaluationError(
                f"{where}: there is no link {label.link}, the arm has links 0 to {links - 1}", source=recording.source
            )
