"""The study's figures as Markdown."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

from tactful.studies.isolation import _trials
from tactful.studies.isolation._summary import ESTIMATORS, METHODS, Figures


def tables(summary: Figures) -> str:
    """Return the tables of a summary."""
    head = (
        f"# Isolation of contacts: {summary['robot']}\n\n"
        f"**From simulation**, seed {summary['seed']}: contacts drawn at random over the arm's surface, poses within "
        f"the joint limits, forces of 5 to 40 N within a friction cone of 0.5; the noise of tau_ext is white, "
        f"{summary['noise_nm']:g} Nm unless stated. Brackets: 95 %, Wilson.\n"
    )
    sections = (
        ("What is wanted and what is reached", _targets),
        ("The link: exact / within one, by noise", _links),
        ("By link", _by_link),
        ("Calibration", _calibration),
        ("Where the model does not hold", _departures),
        ("A second contact, the first known", _known),
        ("Two contacts, neither known", _pairs),
        ("The force at the tip near singularities: median error [N]", _singular),
        ("In motion", _motion),
    )
    return head + "".join(f"\n## {title} (simulation)\n\n{make(summary)}" for title, make in sections)


def _table(headings: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    lines = [headings, ["---"] * len(headings), *rows]
    return "".join(f"| {' | '.join(line)} |\n" for line in lines)


def _rate(share: Any) -> str:
    if share["value"] is None:
        return "-"
    return f"{share['value']:.2f} [{share['low']:.2f}, {share['high']:.2f}]"


def _cm(quantiles: Any) -> str:
    return "-" if quantiles["median"] is None else f"{100 * quantiles['median']:.1f} / {100 * quantiles['p90']:.1f}"


def _percent(quantiles: Any) -> str:
    return "-" if quantiles["median"] is None else f"{100 * quantiles['median']:.1f}"


def _both(right: Any) -> str:
    return f"{_rate(right['exact'])} / {right['within_one']['value']:.2f}"


def _targets(summary: Figures) -> str:
    rows = [
        (
            row["what"],
            row["target"],
            "-" if row["reached"] is None else f"{row['reached']:.3g}",
            "yes" if row["met"] else "**no**",
        )
        for row in summary["targets"]
    ]
    return _table(("", "wanted", "reached", "met"), rows)


def _links(summary: Figures) -> str:
    headings = ("method", *(f"{row['noise_nm']:g} Nm" for row in summary["links"]))
    return _table(headings, [(name, *(_both(row[name]) for row in summary["links"])) for name in METHODS])


def _by_link(summary: Figures) -> str:
    rows = [
        (
            row["link"],
            _both(row),
            _cm(row["point_m"]),
            f"{row['named']['value']:.2f}",
            _cm(row["named_point_m"]),
            _percent(row["force"]),
            _percent(row["magnitude"]),
            _rate(row["magnitude_inside"]),
        )
        for row in summary["by_link"]
    ]
    headings = (
        "link",
        "exact / within one",
        "best point, median / 90 % [cm]",
        "point named",
        "named point, median / 90 % [cm]",
        "force, median [%]",
        "magnitude, median [%]",
        "90 % interval holds the magnitude",
    )
    return _table(headings, rows)


def _calibration(summary: Figures) -> str:
    claims = summary["claims"]
    text = (
        f"P > {claims['above']:g} is claimed of {_rate(claims['made'])} of all contacts, and the link is right in "
        f"{_rate(claims['right'])} of these. The region is right in {_rate(summary['region'])} of all.\n\n"
    )
    rows = [
        (f"{row['above']:g} to {row['up_to']:g}", f"{row['mean']:.3f}", _rate(row["right"]), str(row["right"]["total"]))
        for row in summary["calibration"]
    ]
    return text + _table(("P stated", "mean", "right", "contacts"), rows)


def _departures(summary: Figures) -> str:
    rows = [
        (
            name,
            _both(row["links_4_on"]),
            _rate(row["claims"]["right"]),
            _cm(row["point_m"]),
            _percent(row["force"]),
            _rate(row["misfit"]),
        )
        for name, row in summary["departures"].items()
    ]
    headings = (
        "",
        "links 4 on: exact / within one",
        "claims right",
        "links 5 on: point [cm]",
        "force [%]",
        "misfit flagged",
    )
    return _table(headings, rows)


def _known(summary: Figures) -> str:
    text = (
        f"The first contact is a force at the tip of which the estimate is known, and which has changed by "
        f"{100 * _trials.DRIFT:.0f} % (root mean square) since.\n\n"
    )
    rows = [(row["link"], _both(row), _both(row["unaware"])) for row in summary["known"]]
    return text + _table(("second on", "exact / within one", "the first not taken into account"), rows)


def _pairs(summary: Figures) -> str:
    text = ""
    for case, figures in summary["pairs"].items():
        title = "of single contacts (false)" if case == "false" else case
        groups = {name: value for name, value in figures.items() if name not in ("misfit", "odds")}
        rows = [(f"**{title}**", _rate(figures["odds"]), _rate(figures["misfit"]))]
        rows += [(name, _rate(value["odds"]), _rate(value["misfit"])) for name, value in groups.items()]
        text += _table(("", "by odds", "by misfit"), rows) + "\n"
    return text.removesuffix("\n")


def _singular(summary: Figures) -> str:
    rows = []
    for row in summary["singular"]:
        low, high = row["sigma_min"]
        title = f"from {low:g}" if high is None else f"{low:g} to {high:g}"
        errors = ["-" if row[name]["median"] is None else f"{row[name]['median']:.2f}" for name in ESTIMATORS]
        rows.append((title, *errors, _rate(row["inside"]), str(row["poses"])))
    return _table(("sigma_min", *ESTIMATORS, "90 % intervals of the prior hold", "poses"), rows)


def _motion(summary: Figures) -> str:
    times = (0.01, 0.02, 0.03, 0.05, 0.1, 0.15)
    rows = []
    for row in summary["motion"]:
        right = {point["after_s"]: point["right"] for point in row["over_time"]}
        settled = row["settled_s"]
        rows.append(
            (
                f"{row['bandwidth_hz']:g} Hz",
                *(_rate(right[time]) for time in times),
                f"{1e3 * settled['median']:.0f}",
                _rate(row["settled_within_30_ms"]),
            )
        )
    headings = (
        "observer",
        *(f"right after {1e3 * time:.0f} ms" for time in times),
        "settled, median [ms]",
        "settled within 30 ms",
    )
    return _table(headings, rows)
