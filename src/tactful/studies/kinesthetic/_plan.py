"""Which episodes the study is made of."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import cycle, islice
from typing import Any

from tactful.control import ImpedanceConfig
from tactful.errors import TactfulError
from tactful.simulation import OPERATORS, EpisodeKind, EpisodeSpec, draw_plan

EPISODES = 180
"""How many the evaluation has by default: enough for the 266 events of the paper."""
TUNED_BY = "brisk"
"""The operator of the events that the thresholds of the paper are tuned on."""
PAPER_OPERATORS = ("brisk", "calm", "hesitant", "abrupt")
"""Two experienced operators and two others, as in the paper."""
FURTHER_OPERATORS = tuple(name for name in OPERATORS if name not in PAPER_OPERATORS)
FOLDS = (("brisk", "hesitant", "leading"), ("calm", "abrupt", "shaky"))
"""The operators in two halves: the contacts of one are classified by what was trained on the other."""
PAPER_KINDS: tuple[EpisodeKind, ...] = ("collision", "cooperation", "collision_then_cooperation")
"""What happened in the experiments of the paper."""
VARIATIONS: dict[str, dict[str, Any]] = {
    "K = 75 N/m": {"impedance": ImpedanceConfig(stiffness_n_m=75.0, stiffness_nm_rad=5.0)},
    "K = 600 N/m": {"impedance": ImpedanceConfig(stiffness_n_m=600.0, stiffness_nm_rad=40.0)},
    "B halved": {"impedance": ImpedanceConfig(damping_ns_m=math.sqrt(150.0), damping_nms_rad=math.sqrt(10.0))},
    "payload 0.3 kg heavier than known": {"payload_error_kg": 0.3},
    "another arm of the same make": {"arm": 1},
    "elastic joints": {"elastic": True},
}
"""What is changed in a part of the evaluation, nothing being tuned or calibrated anew."""


def plan(episodes: int, seed: int) -> dict[str, list[EpisodeSpec]]:
    """Return the specs of every set of episodes by its name.

    Sets share no episode, except that the variations repeat a part of the evaluation with something changed. Those
    that begin with `panda` have the noise of a real arm.

    Args:
        episodes: how many the evaluation has; the other sets follow.
        seed: what everything is drawn from.

    Raises:
        TactfulError: if a number is out of range.
    """
    if episodes < 9 or seed < 0:
        raise TactfulError(f"episodes is {episodes} and seed {seed}: they have to be at least 9 and 0")
    seeds = iter(range(100 * seed, 100 * (seed + 1)))

    def few(share: float, least: int = 3) -> int:
        return max(least, round(share * episodes))

    further = few(2 / 9, 2)
    evaluation = draw_plan(episodes - further, next(seeds), kinds=PAPER_KINDS, operators=PAPER_OPERATORS)
    evaluation += draw_plan(further, next(seeds), kinds=PAPER_KINDS[1:], operators=FURTHER_OPERATORS)
    sets = {
        "tuning": draw_plan(few(1 / 3), next(seeds), kinds=PAPER_KINDS, operators=(TUNED_BY,)),
        "evaluation": evaluation,
        "calibration": draw_plan(few(2 / 15, 6), next(seeds), kinds=("free",)),
    }
    for number, operators in enumerate(FOLDS):
        sets[f"training {number}"] = draw_plan(few(1), next(seeds), kinds=PAPER_KINDS, operators=operators)
    sets["transitions"] = draw_plan(few(1 / 6), next(seeds), kinds=("cooperation_then_collision",))
    for name, change in VARIATIONS.items():
        sets[name] = [spec.model_copy(update=change) for spec in varied(evaluation, few(1 / 10))]
    sets["panda calibration"] = draw_plan(few(2 / 15, 6), next(seeds), kinds=("free",), sensors="panda")
    for number, operators in enumerate(FOLDS):
        sets[f"panda training {number}"] = draw_plan(
            few(2 / 3), next(seeds), kinds=PAPER_KINDS, operators=operators, sensors="panda"
        )
    sets["panda evaluation"] = draw_plan(few(1 / 3), next(seeds), kinds=PAPER_KINDS, sensors="panda")
    sets["free"] = draw_plan(few(2.5), next(seeds), kinds=("free",))
    sets["panda free"] = draw_plan(few(5 / 6), next(seeds), kinds=("free",), sensors="panda")
    return sets


def varied(evaluation: Sequence[EpisodeSpec], count: int) -> list[EpisodeSpec]:
    """Return the episodes of the evaluation that the variations repeat: as many of each kind."""
    by_kind = [[spec for spec in evaluation if spec.kind == kind] for kind in PAPER_KINDS]
    turns = [iter(specs) for specs in by_kind]
    chosen = (next(turn, None) for turn in islice(cycle(turns), count))
    return [spec for spec in chosen if spec is not None]


def fold_of(spec: EpisodeSpec, number: int) -> int:
    """Return the fold whose operators an episode does not have; without an operator they take turns.

    Args:
        spec: of the episode.
        number: of the episode in its set.
    """
    for fold, operators in enumerate(FOLDS):
        if spec.operator in operators:
            return 1 - fold
    return number % 2
