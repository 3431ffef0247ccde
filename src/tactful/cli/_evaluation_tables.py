"""Figures of an evaluation as tables."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rich.console import Console
from rich.table import Table
from rich.text import Text

if TYPE_CHECKING:
    from tactful.evaluation import ContactFigures, Figures, ForceError, Outcome, Rate, Share, Spread
    from tactful.monitor import Timeline


@dataclass(frozen=True)
class Run:
    """A recording that was monitored and held against the truth."""

    truth: str
    outcome: "Outcome"
    timeline: "Timeline"
    error: "ForceError | None"

    def to_dict(self) -> dict[str, Any]:
        """Return plain numbers, strings and lists."""
        error = None if self.error is None else self.error.to_dict()
        return {"truth": self.truth, **self.outcome.to_dict(), "force_error": error}


def print_recordings(runs: Sequence[Run], console: Console) -> None:
    """Print one line a recording."""
    table = _table("recording", "truth", "contacts", "found", "false alarms", "in alarm", "free of contact", left=2)
    for run in runs:
        outcome = run.outcome
        table.add_row(
            Path(outcome.source).name,
            Text(run.truth, style="yellow" if run.truth.startswith("none") else ""),
            str(len(outcome.matches)),
            str(outcome.found),
            str(len(outcome.false_alarms)),
            f"{outcome.alarm_s:.1f} s",
            f"{outcome.contact_free_s:.1f} s",
        )
    console.print(table)
    console.print()


def print_figures(
    figures: "Figures", as_recorded: "Figures", groups: Mapping[str, "ContactFigures"], console: Console
) -> None:
    """Print what was found how fast, and the false alarms."""
    if figures.contacts.recall.total:
        table = _table(
            "contacts", "found", "recall", "latency [ms]", "median", "p95", "from 1 N", "onset [ms]", "events", left=1
        )
        for name, group in ({"all": figures.contacts, **groups} if len(groups) > 1 else groups).items():
            latency = group.latency_s
            table.add_row(
                name,
                f"{group.recall.count} of {group.recall.total}",
                percent(group.recall),
                _mean_sd(latency),
                _ms(latency.median),
                _ms(latency.p95),
                _mean_sd(group.visible_latency_s),
                _mean_sd(group.onset_error_s),
                _number(group.events_per_contact, "{:.2f}"),
            )
        console.print(table)
        console.print()
    table = _table("", "", left=2)
    table.show_header = False
    table.add_row("false alarms", _rate(as_recorded.false_alarms))
    if math.isfinite(as_recorded.alarm_share):
        table.add_row("time in false alarm", f"{100 * as_recorded.alarm_share:.1f} % of the time free of contact")
    for name, share in (
        ("link right", figures.contacts.link),
        ("specificity", figures.specificity),
        ("sensitivity", figures.sensitivity),
        ("accuracy", figures.accuracy),
        ("spurious cooperation", figures.spurious_cooperation),
    ):
        if share.total:
            what = " recordings with collisions only" if name == "spurious cooperation" else ""
            table.add_row(name, f"{percent(share)}, {share.count} of {share.total}{what}")
    console.print(table)


def print_shares(shares: Mapping[str, "Share"], console: Console) -> None:
    """Print shares with their intervals, one a line."""
    table = _table("", "", left=2)
    table.show_header = False
    for name, share in shares.items():
        table.add_row(name, f"{percent(share)}, {share.count} of {share.total}")
    console.print(table)


def print_confusion(figures: "Figures", console: Console) -> None:
    """Print what the contacts of each kind were called, as shares of those that were found."""
    counts = figures.confusion.counts
    called = next(iter(counts.values()), {})
    if not called:
        return
    table = _table("called", *(kind.replace("_", " ") for kind in called), "missed", left=1)
    for kind, row in counts.items():
        cells = [f"{row[name]}, {percent(figures.confusion.share(kind, name))}" for name in called]
        table.add_row(kind.replace("_", " "), *cells, str(figures.confusion.missed[kind]))
    console.print()
    console.print(table)


def print_operators(operators: "Mapping[str, Figures]", console: Console) -> None:
    """Print how well the contacts of each operator were found and told, where the recordings name them."""
    if not operators:
        return
    table = _table("operator", "recordings", "recall", "specificity", "sensitivity", "accuracy", left=1)
    for name, figures in operators.items():
        shares = (figures.contacts.recall, figures.specificity, figures.sensitivity, figures.accuracy)
        table.add_row(name, str(figures.recordings), *(percent(share) for share in shares))
    console.print()
    console.print(table)


def print_force_errors(runs: Sequence[Run], console: Console) -> None:
    """Print how far the estimated forces lie from those of the sensor."""
    measured = [(run.outcome.source, run.error) for run in runs if run.error is not None]
    if not measured:
        return
    table = _table("force error, RMS [N]", "x", "y", "z", left=1)
    for source, error in measured:
        table.add_row(Path(source).name, *(f"{value:.2f}" for value in error.rms_n))
    console.print()
    console.print(table)
    told = [(source, error.identified_n) for source, error in measured if error.identified_n is not None]
    if not told:
        return
    table = _table("identified, RMS [N]", "x", "y", "z", "vector", left=1)
    for source, rms in told:
        table.add_row(Path(source).name, *(f"{value:.2f}" for value in (*rms, _norm(rms))))
    both = [_rms([rms[i] for _, rms in told]) for i in range(3)]
    table.add_row("all", *(f"{value:.2f}" for value in (*both, _norm(both))))
    console.print(table)
    console.print(
        Text(
            "Force error: of the monitor's force during contacts, from just before them. Identified: of the force that "
            "the recorded torque tells with a prior on the wrench, over all rows, its bias followed where the monitor "
            "tells no contact.",
            style="dim",
        )
    )


def _norm(values: Sequence[float]) -> float:
    return math.hypot(*values)


def _rms(values: Sequence[float]) -> float:
    return _norm(values) / math.sqrt(len(values))


def print_rule(console: Console) -> None:
    """Print what the figures mean."""
    from tactful.evaluation import EARLY_S, LATE_S

    text = (
        f"A contact is found by the first event detected from {1e3 * EARLY_S:.0f} ms before it to {1e3 * LATE_S:.0f} "
        "ms after it; events: on a found contact. Latency and onset: mean ± SD, from the start of the contact. "
        "Brackets: 95 %, Wilson for shares, Poisson (Garwood) for the rate."
    )
    console.print()
    console.print(Text(text, style="dim"))


def print_injection(figures: "Figures", passes: int, by_chance: int, console: Console) -> None:
    """Print how far the figures of injected contacts can be due to events that are there without them."""
    beside = figures.false_alarms.count
    text = (
        f"Injected in {passes} passes, with {beside} event{'s' * (beside != 1)} beside the contacts. The rate of false "
        f"alarms is that of the recordings as they are, whose own events would have met {by_chance} of the contacts."
    )
    console.print(Text(text, style="dim"))


def _table(*headings: str, left: int) -> Table:
    table = Table(box=None, pad_edge=False, header_style="dim")
    for number, heading in enumerate(headings):
        table.add_column(Text(heading), justify="left" if number < left else "right", overflow="fold")
    return table


def _number(value: float, form: str) -> str:
    return form.format(value) if math.isfinite(value) else "-"


def _ms(value_s: float) -> str:
    return _number(1e3 * value_s, "{:.0f}")


def _mean_sd(spread: "Spread") -> str:
    return f"{_ms(spread.mean)} ± {_ms(spread.sd)}" if spread.n > 1 else _ms(spread.mean)


def percent(share: "Share") -> str:
    """Return a share with its interval."""
    if not share.total:
        return "-"
    low, high = share.interval
    return f"{100 * share.value:.3g} % [{100 * low:.3g}, {100 * high:.3g}]"


def _rate(rate: "Rate") -> str:
    low, high = rate.interval
    seconds = rate.hours * 3600
    time = f"{seconds:.1f} s" if seconds < 600 else f"{rate.hours:.2f} h"
    if not rate.hours > 0:
        return "no time free of contact"
    return f"{rate.per_hour:.3g} per hour [{low:.3g}, {high:.3g}], {rate.count} in {time}"
