"""The study's figures as tables, for Markdown and for the report."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from tactful.studies.kinesthetic._plan import VARIATIONS
from tactful.studies.kinesthetic._published import KINESTHETIC, OTHERS, TABLE_I, TABLE_II, Published
from tactful.studies.kinesthetic._targets import milliseconds, percent

Summary = dict[str, Any]
KINDS = ("collision", "cooperation")
BLOCKS = {
    "paper": "the paper's monitor",
    "best": "fast and learned",
    "best_without_location": "fast and learned, without location",
}


@dataclass(frozen=True)
class Table:
    """A table with what has to be known to read it; its first column is text."""

    key: str
    title: str
    headings: Sequence[str]
    rows: Sequence[Sequence[str]]
    note: str = ""

    def markdown(self) -> str:
        """Return it as Markdown."""
        lines = [self.headings, ["---", *("---:" for _ in self.headings[1:])], *self.rows]
        return "".join(f"| {' | '.join(line)} |\n" for line in lines)


def tables(summary: Summary) -> list[Table]:
    """Return all tables of a summary."""
    makers: Sequence[Callable[[Summary], Iterator[Table]]] = (
        _targets,
        _blocks,
        _table_1,
        _table_2,
        _rules,
        _published,
        _operators,
        _transitions,
        _sensitivity,
        _panda,
        _sets,
    )
    return [table for make in makers for table in make(summary)]


def markdown(summary: Summary) -> str:
    """Return all tables as one page."""
    parts = [f"# Kinesthetic teaching: collision or cooperation\n\n{origin(summary)}\n"]
    for table in tables(summary):
        parts.append(f"\n## {table.title} (simulation)\n\n{table.markdown()}")
        if table.note:
            parts.append(f"\n{table.note}\n")
    return "".join(parts)


def origin(summary: Summary) -> str:
    """Return in two sentences what all figures are of."""
    minutes = sum(part["minutes"] for part in summary["simulated"].values())
    episodes = sum(part["episodes"] for part in summary["simulated"].values())
    return (
        f"From simulation, seed {summary['seed']}: {episodes} episodes, {minutes:.0f} min of robot time, people and "
        "sensors assumed. Latencies count from the first sample with a force; brackets are 95 % intervals."
    )


def _targets(summary: Summary) -> Iterator[Table]:
    rows = [(row["what"], row["target"], row["reached"], "yes" if row["met"] else "no") for row in summary["targets"]]
    note = "Contacts, operators and seeds are none that anything was trained on."
    yield Table("targets", "What is wanted, what is reached", ("", "wanted", "reached", "met"), rows, note)


def _blocks(summary: Summary) -> Iterator[Table]:
    yield _compared("blocks", "On all contacts of the evaluation", {name: summary[key] for key, name in BLOCKS.items()})


def _compared(key: str, title: str, blocks: Mapping[str, Summary]) -> Table:
    lines: dict[str, Callable[[Summary], str]] = {
        "accuracy": lambda b: percent(b["accuracy"]),
        "specificity": lambda b: percent(b["specificity"]),
        "sensitivity": lambda b: percent(b["sensitivity"]),
        "collision, from the touch": lambda b: milliseconds(b["collision_latency_ms"]),
        "collision, from 1 N": lambda b: milliseconds(b["collision_latency_from_1_n_ms"]),
        "cooperation, from the touch": lambda b: milliseconds(b["cooperation_latency_ms"]),
        "cooperation, from 1 N": lambda b: milliseconds(b["cooperation_latency_from_1_n_ms"]),
        "collision that began alone": lambda b: milliseconds(b["collision_alone"]["latency_ms"]),
        "cooperation that began alone": lambda b: milliseconds(b["cooperation_alone"]["latency_ms"]),
        "not found": lambda b: _count(b["misses"]["missed"]),
        "not found, from 6 N on": lambda b: _count(b["misses"]["from_6_n"]),
        "of these: began during another contact": lambda b: str(b["misses"]["during_another"]),
        "taken for more of the same collision": lambda b: str(b["misses"]["continued"]),
        "false alarms per hour of free motion": lambda b: _rate(b["false_alarms_per_hour"]),
        "collision alone, but a cooperation told": lambda b: percent(b["spurious_cooperation_rate"]),
        "events per contact": lambda b: _number(b["events_per_contact"]),
        "SD of the sensitivity between operators": lambda b: _points(b["operator_sd"]),
    }
    rows = [(name, *(show(block) for block in blocks.values())) for name, show in lines.items()]
    contacts = next(iter(blocks.values()))["contacts"]
    note = (
        f"{contacts} contacts. A contact that is found but not classified counts as wrong; one that began alone, while "
        "nothing else touched the arm."
    )
    return Table(key, title, ("", *blocks), rows, note)


def _table_1(summary: Summary) -> Iterator[Table]:
    columns: list[tuple[str, Mapping[str, Mapping[str, int]]]] = [("paper, real robot", TABLE_I)]
    columns += [(BLOCKS[key], found["counts"]) for key, found in summary["protocol"].items()]
    rows = []
    for kind in KINDS:
        for said in (*KINDS, "contact"):
            name = f"{kind} told as {said}" if said != "contact" else f"{kind} not classified"
            rows.append((name, *(_of_row(counts[kind], said) for _, counts in columns)))
    tuned = summary["tuned"]
    note = (
        f"The thresholds of the paper's monitor are tuned on {tuned['collisions']} collisions and "
        f"{tuned['cooperations']} cooperations of the operator {tuned['operator']}: F_th = {tuned['threshold_n']:g} N, "
        f"γ = {tuned['gamma']['floored']:g}."
    )
    yield Table("table1", "Table I of the paper", ("", *(name for name, _ in columns)), rows, note)


def _table_2(summary: Summary) -> Iterator[Table]:
    rows = [(name, "paper, real robot", _of_row(counts, "cooperation")) for name, counts in TABLE_II.items()]
    for key, found in summary["protocol"].items():
        rows += [(name, BLOCKS[key], _of_row(counts, "cooperation")) for name, counts in found["operators"].items()]
    yield Table("table2", "Table II of the paper", ("operator", "monitor", "cooperation told as such"), rows)


def _rules(summary: Summary) -> Iterator[Table]:
    rows = [
        (
            name,
            percent(found["accuracy"]),
            percent(found["specificity"]),
            percent(found["sensitivity"]),
            percent(found["spurious_cooperation_rate"]) if "spurious_cooperation_rate" in found else "-",
        )
        for name, found in (summary["rules"] | summary["baselines"]).items()
    ]
    gamma = summary["tuned"]["gamma"]
    note = (
        f"Tuned to the highest specificity, then sensitivity: γ = {gamma['floored']:g} floored, {gamma['literal']:g} "
        f"literal, {gamma['angle']:g}° angle. As printed: Algorithms 1 and 2 without hysteresis, secant and averages, "
        "γ = 6.2. The last two tell the contacts that the paper's monitor found."
    )
    yield Table(
        "rules",
        "Rules side by side",
        ("", "accuracy", "specificity", "sensitivity", "spurious cooperation"),
        rows,
        note,
    )


def _published(summary: Summary) -> Iterator[Table]:
    rows = [_of_published(paper) for paper in (KINESTHETIC, *OTHERS)]
    for key, name in BLOCKS.items():
        block = summary[key]
        latency = " / ".join(_short_ms(block[f"{kind}_latency_ms"]) for kind in KINDS)
        shares = [_percent(block[part]["value"]) for part in ("accuracy", "specificity", "sensitivity")]
        operators = str(len(block["per_operator"]))
        rows.append((f"here, simulated: {name}", *shares, latency, _points(block["operator_sd"]), operators))
    headings = ("", "accuracy", "specificity", "sensitivity", "detected after", "SD between operators", "operators")
    note = "Published figures are of real robots, other tasks and people: they say what is usual, not what is better."
    yield Table("published", "Beside published figures", headings, rows, note)


def _of_published(paper: Published) -> tuple[str, ...]:
    shares = [
        "-" if value is None else f"{value:g} %" for value in (paper.accuracy, paper.specificity, paper.sensitivity)
    ]
    sd = "-" if paper.operator_sd is None else f"{paper.operator_sd:g} points"
    operators = "-" if paper.operators is None else str(paper.operators)
    return f"{paper.name}: {paper.what}", *shares, paper.latency or "-", sd, operators


def _operators(summary: Summary) -> Iterator[Table]:
    shares = [summary[key]["per_operator"] for key in BLOCKS]
    rows = [(name, *(percent(of[name]) if name in of else "-" for of in shares)) for name in shares[1]]
    yield Table("operators", "Sensitivity by operator", ("operator", *BLOCKS.values()), rows)


def _transitions(summary: Summary) -> Iterator[Table]:
    found = summary["transitions"]
    lines: dict[str, Callable[[Summary], str]] = {
        "collision to free: told": lambda t: percent(t["collision_to_free"]),
        "collision to free: told after its end": lambda t: milliseconds(t["told_after_ms"]),
        "collision after cooperation, hand gone": lambda t: percent(t["cooperation_to_collision"]["hand_gone"]),
        "collision after cooperation, hand still there": lambda t: percent(
            t["cooperation_to_collision"]["hand_still_there"]
        ),
    }
    rows = [(name, *(show(transition) for transition in found.values())) for name, show in lines.items()]
    note = "The paper did not test these. The monitor tells one contact at a time."
    yield Table("transitions", "Transitions", ("", *(BLOCKS[key] for key in found)), rows, note)


def _sensitivity(summary: Summary) -> Iterator[Table]:
    headings = ("", "monitor", "accuracy", "specificity", "sensitivity", "missed", "collision / cooperation after")
    rows = []
    found = summary["sensitivity"]
    for key in ("paper", "best"):
        part = found[key]
        rows += [_line(f"speed {name} m/s", key, figures) for name, figures in part["speed"].items()]
        approach = {"axis": "approach along the axes", "diagonal": "approach diagonal"}
        rows += [_line(approach[name], key, figures) for name, figures in part["approach"].items()]
        rows.append(_line("the part that is varied, as it is", key, part["reference"]))
        rows += [_line(name, key, part[name]) for name in VARIATIONS]
    note = (
        "Each line below `as it is` repeats those episodes with one thing changed; nothing is tuned, calibrated or "
        "trained anew. Another arm is monitored with the calibration of the first."
    )
    yield Table("sensitivity", "Sensitivity to what is not as it was", headings, rows, note)
    turned = [
        (
            name,
            *(f"{_percent(f['specificity']['value'])} / {_percent(f['sensitivity']['value'])}" for f in pair.values()),
        )
        for name, pair in found["turned"].items()
    ]
    yield Table(
        "turned",
        "Axes of the base turned by 45° about (1, 1, 1): specificity / sensitivity",
        ("", "as they are", "turned"),
        turned,
        "The same episodes: what depends on the choice of axes tells them differently. The paper's detector does, too.",
    )


def _line(name: str, monitor: str, figures: Summary) -> tuple[str, ...]:
    latency = " / ".join(_short_ms(figures[f"{kind}_latency_ms"]) for kind in KINDS)
    shares = [percent(figures[key]) for key in ("accuracy", "specificity", "sensitivity")]
    return name, BLOCKS[monitor], *shares, _count(figures["misses"]["missed"]), latency


def _panda(summary: Summary) -> Iterator[Table]:
    blocks = {name: summary["panda"][key] for key, name in BLOCKS.items()}
    table = _compared("panda", "With the noise of a real Panda", blocks)
    note = (
        f"{table.note} F_th = {summary['panda']['threshold_n']:g} N, the least without false alarms in the calibration "
        "motion; calibrated and trained on episodes with this noise."
    )
    yield Table(table.key, table.title, table.headings, table.rows, note)


def _sets(summary: Summary) -> Iterator[Table]:
    rows = [(name, str(part["episodes"]), f"{part['minutes']:.1f}") for name, part in summary["simulated"].items()]
    note = (
        f"{summary['impossible']} specs gave no episode of their kind and are left out."
        if summary["impossible"]
        else ""
    )
    yield Table("sets", "What was simulated", ("set", "episodes", "min"), rows, note)


def _of_row(counts: Mapping[str, int], said: str) -> str:
    total = sum(counts.values())
    count = counts.get(said, 0)
    return f"{count} ({100 * count / total:.1f} %)" if total else "-"


def _count(share: Summary) -> str:
    return f"{share['count']} of {share['total']}"


def _rate(rate: Summary) -> str:
    if rate["per_hour"] is None:
        return "-"
    interval = f"[{rate['low']:.2g}, {rate['high']:.2g}]"
    return f"{rate['per_hour']:.2g} {interval} ({rate['count']} in {60 * rate['hours']:.0f} min)"


def _number(value: float | None) -> str:
    return "-" if value is None else f"{value:.2f}"


def _points(value: float | None) -> str:
    return "-" if value is None else f"{100 * value:.1f} points"


def _percent(value: float | None) -> str:
    return "-" if value is None else f"{100 * value:.1f} %"


def _short_ms(spread: Summary) -> str:
    return "-" if spread["mean"] is None else f"{spread['mean']:.0f} ± {spread['sd'] or 0:.0f} ms"
