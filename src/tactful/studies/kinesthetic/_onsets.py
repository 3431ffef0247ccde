"""What the rules of the paper see of a contact, written down so that it can be classified again."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from tactful.classification import Classifier, KinestheticConfig, Onset, Verdict

Note = dict[str, Any]


class NotedClassifier:
    """A classifier that notes what it is asked.

    Args:
        inner: what answers.
        config: over which times the change of the force and the velocity are taken.
    """

    def __init__(self, inner: Classifier, config: KinestheticConfig) -> None:
        self.notes: list[Note] = []
        self._inner, self._config = inner, config

    def classify(self, onset: Onset) -> Verdict:
        """Return what the inner classifier says."""
        verdict = self._inner.classify(onset)
        before = onset.velocity_before_m_s(self._config.velocity_s)
        if before is not None and onset.velocity_m_s is not None:
            self.notes.append(
                {
                    "t": float(onset.t[-1]),
                    "force_change_n": onset.force_change_n(self._config.secant_s).tolist(),
                    "velocity_m_s": before.tolist(),
                    "velocity_after_m_s": onset.velocity_m_s[-1].tolist(),
                    "directions": onset.directions.tolist(),
                    "in_collision": onset.in_collision,
                }
            )
        return verdict


def onset_of(note: Note) -> Onset:
    """Return an onset of two samples that says the same as the one that was noted."""
    return Onset(
        rate_hz=1.0,
        t=np.array([0.0, 1.0]),
        force_n=np.array([[0.0, 0.0, 0.0], note["force_change_n"]]),
        moment_nm=np.zeros((2, 3)),
        velocity_m_s=np.array([note["velocity_m_s"], note["velocity_after_m_s"]]),
        tau_ext_nm=None,
        index=0,
        directions=np.array(note["directions"]),
        in_collision=note["in_collision"],
    )


def note_at(notes: Sequence[Note], detected_s: float) -> Note | None:
    """Return what was asked at a detection."""
    return next((note for note in notes if abs(note["t"] - detected_s) < 1e-6), None)


def unit_vectors(note: Note) -> np.ndarray[Any, np.dtype[np.float64]]:
    """Return the unit vectors of the change of the force and of the velocity (6,), what the paper gives to Fisher."""
    parts = [np.array(note[key]) for key in ("force_change_n", "velocity_m_s")]
    return np.concatenate([x / max(float(np.linalg.norm(x)), 1e-12) for x in parts])
