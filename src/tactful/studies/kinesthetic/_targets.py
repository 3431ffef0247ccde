"""What is wanted of the best monitor, held against what it reaches."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

Summary = dict[str, Any]


def targets(summary: Summary) -> list[Summary]:
    """Return what is wanted and what is reached; a target is met where the figure is, whatever its interval."""
    rows = list(_of_block(summary["best"], "", accuracy=0.97))
    rows += _of_block(summary["best_without_location"], ", without location", accuracy=0.94)
    return rows


def _of_block(block: Summary, suffix: str, *, accuracy: float) -> Iterator[Summary]:
    for name, share, wanted in (
        ("accuracy", block["accuracy"], accuracy),
        ("specificity", block["specificity"], 0.98),
        ("sensitivity", block["sensitivity"], 0.95),
    ):
        yield _row(name + suffix, f"at least {100 * wanted:g} %", percent(share), _least(share["value"], wanted))
    sd = block["operator_sd"]
    said = "-" if sd is None else f"{100 * sd:.1f} points"
    yield _row(f"SD of the sensitivity between operators{suffix}", "at most 2.5 points", said, _most(sd, 0.025))
    for kind, wanted_ms in (("collision", 12.0), ("cooperation", 60.0)):
        latency = block[f"{kind}_latency_ms"]
        yield _row(
            f"{kind} detected after the touch, mean{suffix}",
            f"at most {wanted_ms:g} ms",
            milliseconds(latency),
            _most(latency["mean"], wanted_ms),
        )
    missed = block["misses"]["from_6_n"]
    yield _row(f"missed from 6 N on{suffix}", "none", f"{missed['count']} of {missed['total']}", missed["count"] == 0)
    alarms = block["false_alarms_per_hour"]
    said = f"{alarms['count']} in {60 * alarms['hours']:.0f} min"
    met = alarms["count"] == 0 and alarms["hours"] >= 1
    yield _row(f"false alarms in contact-free motion{suffix}", "none in 60 min", said, met)
    spurious = block["spurious_cooperation_rate"]
    yield _row(
        f"episodes of collision alone with a cooperation{suffix}",
        "at most 5 %",
        percent(spurious),
        _most(spurious["value"], 0.05),
    )


def percent(share: Summary) -> str:
    """Return a share with its interval [%]."""
    if share["value"] is None:
        return "-"
    return f"{100 * share['value']:.1f} % [{100 * share['low']:.1f}, {100 * share['high']:.1f}]"


def milliseconds(spread: Summary) -> str:
    """Return mean, standard deviation and median [ms]."""
    if spread["mean"] is None:
        return "-"
    sd = "" if spread["sd"] is None else f" ± {spread['sd']:.0f}"
    return f"{spread['mean']:.1f}{sd} ms (median {spread['median']:.1f})"


def _least(value: float | None, wanted: float) -> bool:
    return value is not None and value >= wanted


def _most(value: float | None, wanted: float) -> bool:
    return value is not None and value <= wanted


def _row(what: str, wanted: str, reached: str, met: bool) -> Summary:
    return {"what": what, "target": wanted, "reached": reached, "met": met}
