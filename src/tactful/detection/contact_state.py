"""The states of a contact: Algorithm 1 of the kinesthetic paper, as a kernel.

A detector gives a level and a threshold for each of its directions; sets of directions are bit masks. The kernel says
in the same sample that a contact was detected; what it is, the classifier says, and `tell` sets the state.

Source: J. Salt Ducaju et al. 2022, doi:10.1109/RO-MAN53752.2022.9900800. Different from it, each by a setting of
`ContactConfig`: hysteresis, the end of a collision, and the force as a second witness of the end.
"""

from __future__ import annotations

import functools
import math
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from tactful.detection._config import ContactConfig

FREE, COLLISION, COOPERATION, CONTACT = range(4)
"""States: FREE, COLL and COOP of the paper, and contact that is not classified."""

NOTHING, DETECTED, NEW_DIRECTION, ENDED = range(4)
"""What a sample may bring."""


@functools.cache
def contact_dtype(directions: int) -> np.dtype[np.void]:
    """Return the layout of the settings and the state of a contact with so many directions."""
    return np.dtype(
        [
            ("threshold", "f8", (directions,)),
            ("release_ratio", "f8"),
            ("hold", "i8"),  # [samples]
            ("release_force", "f8"),  # inf: the level alone
            ("collision_to_free", "i8"),
            ("state", "i8"),
            ("active", "i8"),  # the directions that are part of the contact
            ("pending", "i8"),  # the directions that were just detected
            ("quiet", "i8", (directions,)),  # samples since the level was last above the release level
            ("force_free", "f8", (3,)),  # before the state FREE was left
            ("force_before", "f8", (3,)),  # before this contact
            ("back", "i8"),  # samples since the force returned to where it was
            ("ended_ago", "i8"),  # how many samples before the last one the contact ended
            ("peak", "f8"),  # largest change of the force since the onset [N]
        ],
        align=True,
    )


def contact_record(config: ContactConfig, threshold: NDArray[np.float64], rate_hz: float) -> Any:
    """Return the state of an arm that nothing touches."""
    record: Any = np.zeros(1, contact_dtype(len(threshold)))
    record["threshold"] = threshold
    record["release_ratio"] = config.release_ratio
    record["hold"] = round(config.hold_s * rate_hz)
    record["release_force"] = math.inf if config.release_force_n is None else config.release_force_n
    record["collision_to_free"] = config.collision_to_free
    return record


@njit(cache=True)
def tell(contact: Any, state: int) -> None:
    """Set the state after a detection: what was pending becomes active."""
    contact.state = state
    contact.active |= contact.pending
    contact.pending = 0
    contact.back = 0


@njit(cache=True)
def clear(contact: Any) -> None:
    """Return to FREE."""
    contact.state = FREE
    contact.active = 0
    contact.pending = 0


@njit(cache=True)
def advance(contact: Any, level: NDArray[np.float64], force: NDArray[np.float64]) -> int:
    """Take the levels (directions,) and the force (3,) of one sample and return what it brings."""
    over = 0
    all_quiet = True
    for i in range(level.shape[0]):
        threshold = contact.threshold[i]
        if level[i] > threshold:
            over |= 1 << i
        if level[i] > contact.release_ratio * threshold:
            contact.quiet[i] = 0
            all_quiet = False
        else:
            contact.quiet[i] += 1
            if contact.quiet[i] <= contact.hold:
                all_quiet = False
            else:
                contact.active &= ~(1 << i)
    if contact.state == FREE:
        if over == 0:
            return NOTHING
        contact.pending = over
        return DETECTED
    change = 0.0
    returned = True
    freed = True
    for i in range(3):
        difference = force[i] - contact.force_before[i]
        change += difference * difference
        if abs(difference) > contact.release_force:
            returned = False
        if abs(force[i] - contact.force_free[i]) > contact.release_force:
            freed = False
    contact.peak = max(contact.peak, np.sqrt(change))
    contact.back = contact.back + 1 if returned or freed else 0
    if contact.state == COLLISION:
        new = over & ~contact.active
        if new != 0:
            contact.pending = new
            return NEW_DIRECTION
        if contact.collision_to_free == 0:
            return NOTHING
    else:
        contact.active |= over
    if all_quiet and contact.back > contact.hold:
        contact.ended_ago = contact.back - 1
        if contact.release_force == np.inf:
            for i in range(level.shape[0]):
                contact.ended_ago = min(contact.ended_ago, contact.quiet[i] - 1)
        clear(contact)
        return ENDED
    return NOTHING
