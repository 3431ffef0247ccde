"""Algorithm 1 of the kinesthetic paper, state by state."""

from typing import Any

import numpy as np
import pytest

from tactful.detection import ContactConfig, FrequencyConfig, thresholds
from tactful.detection.contact_state import (
    COLLISION,
    COOPERATION,
    DETECTED,
    ENDED,
    FREE,
    NEW_DIRECTION,
    NOTHING,
    advance,
    contact_record,
    tell,
)

X, Y, Z = 1, 2, 4
NO_FORCE = np.zeros(3)
PAPER = ContactConfig(release_ratio=1.0, hold_s=0.0, release_force_n=None, collision_to_free=False, merge_s=0.0)


def contact(config: ContactConfig) -> Any:
    """Return a contact with the threshold 1 N at 100 Hz."""
    tolerance = np.full(3, np.inf if config.release_force_n is None else config.release_force_n)
    return contact_record(config, np.ones(3), tolerance, 100.0)[0]


def take(state: Any, *level: float, force: Any = NO_FORCE) -> int:
    """Take one sample."""
    signal = np.asarray(force, dtype=np.float64)
    return advance(state, np.array(level), signal, signal)


def test_free_until_a_level_is_above_its_threshold() -> None:
    """Condition (4): the threshold itself is not contact, and the directions that are above it are named."""
    state = contact(PAPER)
    assert take(state, 1.0, 1.0, 1.0) == NOTHING
    assert take(state, 0.0, 1.1, 1.2) == DETECTED
    assert state["pending"] == Y | Z


def test_a_collision_looks_only_at_directions_that_are_not_part_of_it() -> None:
    """Line 9: the directions of the collision do not count as a new contact, others do."""
    state = contact(PAPER)
    take(state, 0, 0, 2)
    tell(state, COLLISION)
    assert take(state, 0, 0, 3) == NOTHING
    assert take(state, 0, 2, 3) == NEW_DIRECTION
    assert state["pending"] == Y


def test_a_direction_of_a_collision_that_fell_silent_can_speak_again() -> None:
    """Line 13: what stops violating the threshold is no longer part of the collision."""
    state = contact(PAPER)
    take(state, 0, 0, 2)
    tell(state, COLLISION)
    assert take(state, 0, 0, 0.5) == NOTHING
    assert state["active"] == 0
    assert take(state, 0, 0, 2) == NEW_DIRECTION


def test_the_paper_leaves_a_collision_only_through_the_classifier() -> None:
    """Algorithm 1 has no transition from COLL to FREE."""
    state = contact(PAPER)
    take(state, 0, 0, 2)
    tell(state, COLLISION)
    assert {take(state, 0, 0, 0) for _ in range(1000)} == {NOTHING}
    assert state["state"] == COLLISION


def test_cooperation_ends_when_all_directions_are_below_the_threshold() -> None:
    """Line 15, in the sample in which it happens, with the paper's settings."""
    state = contact(PAPER)
    take(state, 2, 0, 0)
    tell(state, COOPERATION)
    assert take(state, 0, 2, 0) == NOTHING
    assert take(state, 0.5, 0.5, 0.5) == ENDED
    assert state["state"] == FREE


def test_hysteresis_keeps_one_push_one_contact() -> None:
    """A level that trembles around the threshold is one contact, which without hysteresis would be many."""
    ends = {}
    for config in (PAPER, ContactConfig(release_force_n=None)):
        state = contact(config)
        count = 0
        for k in range(200):
            code = take(state, 1.2 if k % 2 else 0.9, 0, 0)
            if code == DETECTED:
                tell(state, COOPERATION)
            count += code == ENDED
        ends[config.release_ratio] = count
    assert ends == {1.0: 99, 0.7: 0}


def test_a_contact_lasts_while_the_force_is_there() -> None:
    """The level of a steady push is zero; the force that stayed says that the contact is not over."""
    state = contact(ContactConfig(hold_s=0.05))
    take(state, 2, 0, 0)
    tell(state, COOPERATION)
    push = [5.0, 0, 0]
    assert {take(state, 0, 0, 0, force=push) for _ in range(500)} == {NOTHING}
    codes = [take(state, 0, 0, 0) for _ in range(7)]
    assert codes == [NOTHING] * 5 + [ENDED, NOTHING]
    assert state["ended_ago"] == 5  # it ended when the force came back, not when that was certain


def test_help_out_of_a_collision_ends_when_the_arm_is_free() -> None:
    """Cooperation that began under the force of a collision ends also when that force is gone."""
    state = contact(ContactConfig(hold_s=0.0))
    state["before"] = [0, 0, 9.0]
    take(state, 2, 0, 0)
    tell(state, COOPERATION)
    assert take(state, 0, 0, 0, force=[5, 0, 4.0]) == NOTHING
    assert take(state, 0, 0, 0, force=[0, 0, 0.5]) == ENDED


def test_thresholds_can_differ_between_directions() -> None:
    """One F_th is for all directions, three are for x, y and z."""
    np.testing.assert_array_equal(thresholds(FrequencyConfig()), [0.85] * 3)
    np.testing.assert_array_equal(thresholds(FrequencyConfig(threshold_n=(1, 2, 3))), [1, 2, 3])


@pytest.mark.parametrize("seed", range(5))
def test_against_a_plain_implementation_of_the_algorithm(seed: int) -> None:
    """With the paper's settings the kernel is Algorithm 1, written again here with sets."""
    rng = np.random.default_rng(seed)
    state = contact(PAPER)
    mode, active = "FREE", set[int]()
    for level in rng.gamma(1.0, 0.5, size=(3000, 3)):
        over = {i for i in range(3) if level[i] > 1.0}
        code = advance(state, level, NO_FORCE, NO_FORCE)
        if mode == "FREE" and over:
            assert code == DETECTED
            mode, active = ("COLL", over) if rng.random() < 0.7 else ("COOP", over)
        elif mode == "COLL":
            active = {i for i in active if level[i] > 1.0}
            if over - active:
                assert code == NEW_DIRECTION
                active |= over
                mode = "COLL" if rng.random() < 0.7 else "COOP"
            else:
                assert code == NOTHING
        elif mode == "COOP" and not over:
            assert code == ENDED
            mode, active = "FREE", set()
        else:
            assert code == NOTHING
        if code in (DETECTED, NEW_DIRECTION):
            tell(state, COLLISION if mode == "COLL" else COOPERATION)
