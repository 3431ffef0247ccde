"""The published figures, from real robots."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Published:
    """What a paper reports; None where it does not.

    Attributes:
        name: authors and year.
        what: the method.
        accuracy: contacts told rightly [%].
        specificity: collisions told rightly [%].
        sensitivity: cooperations told rightly [%].
        latency: time to the detection, or to the decision, as reported.
        operator_sd: standard deviation of the sensitivity between operators [points].
        operators: how many.
    """

    name: str
    what: str
    accuracy: float | None
    specificity: float | None
    sensitivity: float | None
    latency: str
    operator_sd: float | None
    operators: int | None


KINESTHETIC = Published(
    "Salt Ducaju et al. 2022", "level and direction of the force", 91.4, 93.3, 88.9, "71 ± 31 / 133 ± 66 ms", 4.4, 4
)
"""The paper: 120 collisions and 90 cooperations; F_th = 0.85 N, gamma = 6.2."""
OTHERS = (
    Published("the same", "Fisher's discriminant on both directions", 83.3, None, None, "", None, 4),
    Published("Golz et al. 2015", "features of the whole contact", 97.8, None, None, "after the contact", None, 1),
    Published("Popov et al. 2017", "neural network, offline", 89.5, None, None, "not in real time", None, None),
    Published("Briquet-Kerestedjian et al. 2019", "neural network", 81.9, None, None, "160 ms or more", 7.3, 3),
    Published("Cioffi et al. 2020", "online learning, trained on the operator", 86.3, None, None, "", 10.1, 4),
    Published(
        "Geravand et al. 2013", "motor currents, six thresholds a joint", None, None, None, "below 50 ms", None, None
    ),
    Published(
        "Kouris et al. 2016, 2018",
        "level of one force direction, external sensor",
        None,
        None,
        None,
        "below 10 ms",
        None,
        None,
    ),
)
"""References 5 to 11 of the paper, with the figures that it quotes."""

TABLE_I = {"collision": {"collision": 112, "cooperation": 8}, "cooperation": {"collision": 10, "cooperation": 80}}
TABLE_II = {
    "Operator 1": {"collision": 1, "cooperation": 25},
    "Operator 2": {"collision": 3, "cooperation": 18},
    "Operator 3": {"collision": 4, "cooperation": 23},
    "Operator 4": {"collision": 2, "cooperation": 14},
}
