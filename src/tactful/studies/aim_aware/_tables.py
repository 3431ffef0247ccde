"""The study's figures as Markdown."""

from __future__ import annotations

from tactful.studies.aim_aware._summary import TOLERANCE_DEG, Figures

_TITLES = {"table1": "Tab. 1 verbatim", "tuned": "tuned", "raw": "raw error, tuned"}


def tables(summary: Figures) -> str:
    """Return the tables of bands, robustness and targets."""
    lines = [
        "# Expected or unexpected impact, simulated",
        "",
        f"{summary['impacts']} impacts of the grid {summary['grid']!r}; {summary['cpu_s']:.0f} s of CPU for it.",
        "",
        "| set | wanted | band [deg] | ambiguous [deg] | beyond | held out: band | ambiguous | beyond |",
        "| --- | --- | --- | --- | --- | --- | --- | --- |",
    ]
    for group, title in _TITLES.items():
        for name, tolerance in TOLERANCE_DEG.items():
            found = summary[group][name]
            cells = [*_cells(found), *_cells(found["held_out"])]
            lines.append(f"| {title}, {name} | ±{tolerance:g} | " + " | ".join(cells) + " |")
    lines += [
        "",
        f"Inclination from the tip in contact, held out, within ±8 deg: mean error {summary['inclination_mae_deg']:.2g}"
        f" deg, worst {summary['inclination_worst_deg']:.2g} deg.",
        "",
        "## Tuned anew on what differs; held-out impacts",
        "",
        "| variant | " + " | ".join(f"±{B:g}: band, ambiguous, beyond" for B in TOLERANCE_DEG.values()) + " |",
        "| --- | " + " | ".join("---" for _ in TOLERANCE_DEG) + " |",
    ]
    for row in summary["robustness"]:
        cells = [", ".join(_cells(row[name])) if "rate" in row[name] else "cannot be tuned" for name in TOLERANCE_DEG]
        lines.append(f"| {row['variant']} | " + " | ".join(cells) + " |")
    lines += ["", "## Targets", "", "| what | target | reached | |", "| --- | --- | --- | --- |"]
    for row in summary["targets"]:
        lines.append(f"| {row['what']} | {row['target']} | {row['reached']} | {'' if row['met'] else 'missed'} |")
    return "\n".join(lines) + "\n"


def _cells(found: Figures) -> list[str]:
    band, (low, high) = found["band_deg"], found["ambiguous_deg"]
    said = "none" if band is None else f"[{band[0]:g}, {band[1]:g}]"
    return [said, f"{low:g} / {high:g}", f"{100 * found['accepted_beyond']:.2g} %"]
