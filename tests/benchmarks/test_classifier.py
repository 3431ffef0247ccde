"""What the classifier that is part of Tactful learns from."""

import numpy as np

from benchmarks.classifier.__main__ import HABITS, Note, learnable
from tactful.classification import FEATURES
from tactful.learning import Decision, Seen


def test_habits_of_a_scene_and_late_onsets_are_not_learned():
    """The first onset counts in any case, further ones within the time that the classifier may take."""
    asks = tuple(Note(Seen(np.ones(len(FEATURES)), since_s), {}) for since_s in (0.02, 0.07, 0.09))
    seen = Decision(truth="collision", contact=("a", 0), operator="peg", after_collision=True, asks=asks)
    learned = learnable(seen, wait_s=0.07)
    assert [ask.since_s for ask in learned.asks] == [0.02, 0.07]
    unknown = {name for name, value in zip(FEATURES, learned.asks[0].features, strict=True) if np.isnan(value)}
    assert unknown == set(HABITS)
    assert learned.after_collision
