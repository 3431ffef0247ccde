"""The states of a contact: Algorithm 1 of the kinesthetic paper, as a kernel.

A detector gives a level and a threshold for each of its directions; sets of directions are bit masks. The kernel says
in the same sample that a contact was detected; what it is, the classifier says, and `tell` sets the state.

Source: J. Salt Ducaju et al. 2022, doi:10.1109/RO-MAN53752.2022.9900800. Different from it, each by a setting of
`ContactConfig`: hysteresis, the end of a collision, and the force as a second witness of the end.
"""

from __future__ import annotations

import functools
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tactful._njit import njit
from tactful.detection._config import ContactConfig

FREE, COLLISION, COOPERATION, CONTACT = range(4)
"""States: FREE, COLL and COOP of the paper, and contact that is not classified."""

NOTHING, DETECTED, NEW_DIRECTION, ENDED, DECIDE = range(5)
"""What a sample may bring."""


@functools.cache
def contact_dtype(directions: int, channels: int) -> np.dtype[np.void]:
    """Return the layout of the settings and the state of a contact.

    Args:
        directions: in which a detector tells contact.
        channels: of the signal that says whether the contact is over.
    """
    return np.dtype(
        [
            ("threshold", "f8", (directions,)),
            ("release_ratio", "f8"),
            ("hold", "i8"),  # [samples]
            ("tolerance", "f8", (channels,)),  # how far the signal may be from what it was; inf: the level alone
            ("until_quiet", "i8"),  # whether the level has to be quiet when a contact ends
            ("collision_to_free", "i8"),
            ("state", "i8"),
            ("active", "i8"),  # the directions that are part of the contact
            ("pending", "i8"),  # the directions that were just detected
            ("quiet", "i8", (directions,)),  # samples since the level was last above the release level
            ("free", "f8", (channels,)),  # the signal before the state FREE was left
            ("before", "f8", (channels,)),  # and before this contact
            ("force_before", "f8", (3,)),
            ("decide", "i8"),  # samples from a detection to its classification
            ("countdown", "i8"),  # how many of them are left; 0: nothing is undecided
            ("back", "i8"),  # samples since the signal returned to where it was
            ("ended_ago", "i8"),  # how many samples before the last one the contact ended
            ("peak", "f8"),  # largest change of the force since the onset [N]
        ],
        align=True,
    )


def contact_record(
    config: ContactConfig,
    threshold: NDArray[np.float64],
    tolerance: NDArray[np.float64],
    rate_hz: float,
    decide_s: float = 0.0,
    until_quiet: bool = True,
) -> Any:
    """Return the state of an arm that nothing touches.

    Args:
        config: the settings.
        threshold: of each direction (directions,); inf for one that is not used.
        tolerance: how far each channel of the signal may be from before the contact when it is over (channels,).
        rate_hz: sampling rate [Hz].
        decide_s: time from a detection to its classification [s].
        until_quiet: whether the level has to be quiet when a contact ends, beside the signal.
    """
    record: Any = np.zeros(1, contact_dtype(len(threshold), len(tolerance)))
    record["threshold"] = threshold
    record["tolerance"] = tolerance
    record["decide"] = round(decide_s * rate_hz)
    record["until_quiet"] = until_quiet
    record["release_ratio"] = config.release_ratio
    record["hold"] = round(config.hold_s * rate_hz)
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
    contact.countdown = 0
    contact.active = 0
    contact.pending = 0


@njit(cache=True)
def advance(contact: Any, level: NDArray[np.float64], signal: NDArray[np.float64], force: NDArray[np.float64]) -> int:
    """Take the levels (directions,), the signal (channels,) and the force (3,) of one sample; return what it brings."""
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
    limited = False
    for i in range(signal.shape[0]):
        tolerance = contact.tolerance[i]
        limited = limited or tolerance < np.inf
        if abs(signal[i] - contact.before[i]) > tolerance:
            returned = False
        if abs(signal[i] - contact.free[i]) > tolerance:
            freed = False
    contact.peak = max(contact.peak, np.sqrt(change))
    contact.back = contact.back + 1 if returned or freed else 0
    if contact.countdown > 0:
        contact.active |= over
        contact.countdown -= 1
        return DECIDE if contact.countdown == 0 else NOTHING
    if contact.state == COLLISION:
        new = over & ~contact.active
        if new != 0:
            contact.pending = new
            return NEW_DIRECTION
        if contact.collision_to_free == 0:
            return NOTHING
    else:
        contact.active |= over
    if contact.back > contact.hold and (all_quiet or contact.until_quiet == 0):
        contact.ended_ago = contact.back - 1
        if not limited:
            for i in range(level.shape[0]):
                contact.ended_ago = min(contact.ended_ago, contact.quiet[i] - 1)
        clear(contact)
        return ENDED
    return NOTHING
