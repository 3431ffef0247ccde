"""Decisions by hand: features whose distribution is known."""

from __future__ import annotations

import numpy as np

from tactful.classification import FEATURES
from tactful.learning import Decision, Seen

NAMES = tuple(FEATURES)


def decisions(
    n: int, seed: int = 0, *, operators: tuple[str | None, ...] = ("a", "b", "c"), apart: float = 1.5
) -> list[Decision[Seen]]:
    """Return n contacts, half of each kind, that `power` and, less, `abrupt` tell; all other features are noise.

    Two onsets each, 20 and 40 ms after the detection, of which the later one says more.
    """
    rng = np.random.default_rng(seed)
    made = []
    for number in range(n):
        helped = number % 2 == 1
        asks = []
        for since_s, sharp in ((0.02, 0.7), (0.04, 1.0)):
            x = rng.standard_normal(len(NAMES))
            sign = 1.0 if helped else -1.0
            x[NAMES.index("power")] += sign * apart * sharp
            x[NAMES.index("abrupt")] += 0.5 * sign * apart * sharp
            for name in ("from_tip", "along_collision", "beside_collision", "with_force_beside", "since_collision"):
                x[NAMES.index(name)] = np.nan
            asks.append(Seen(x, since_s))
        made.append(
            Decision(
                truth="cooperation" if helped else "collision",
                contact=(f"{number}.npz", 0),
                operator=operators[(number // 2) % len(operators)],
                after_collision=False,
                asks=tuple(asks),
            )
        )
    return made
