"""What was wanted, and what was reached."""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from typing import Any

import numpy as np

from tactful.studies.aim_aware._variants import FRICTION

Figures = dict[str, Any]


def targets(figures: Figures, tolerances_deg: Mapping[str, float]) -> list[Figures]:
    """Compare the figures of the study with what was wanted."""
    rows: list[Figures] = []

    def add(what: str, target: str, reached: str, met: bool) -> None:
        rows.append({"what": what, "target": target, "reached": reached, "met": bool(met)})

    titles = {
        "tuned": "the paper's conditions",
        "tilt": "with the tilt",
        "early": "with the tilt, from the first impact",
    }
    for (group, title), (name, B) in itertools.product(titles.items(), tolerances_deg.items()):
        for where, found in (("grid", figures[group][name]), ("held out", figures[group][name]["held_out"])):
            band, (low, high) = found["band_deg"], found["ambiguous_deg"]
            held = band is not None and band[0] <= -B and band[1] >= B
            exact = held and (where == "held out" or figures["grid"] != "paper" or band == [-B, B])
            most = 2.0 if where == "grid" and figures["grid"] == "paper" else 1.5
            add(
                f"{tolerance_text(B)}, {title}, {where}",
                f"band, <= {most:g} deg ambiguous, none beyond",
                f"{band_text(band)}, {low:g} / {high:g} deg, {100 * found['accepted_beyond']:.2g} %",
                exact and max(low, high) <= most and found["accepted_beyond"] == 0,
            )
    add("CPU for the grid", "< 240 s", f"{figures['cpu_s']:.0f} s", figures["cpu_s"] < 240)
    error = figures["inclination_mae_deg"]
    add("inclination, held out", "<= 1 deg", f"{error:.2g} deg", error <= 1)
    wait_ms = 1e3 * figures["verdict_after_last_impact_s"]["largest"]
    add("verdict after the last impact, all", "<= 100 ms", f"{wait_ms:.0f} ms", wait_ms <= 100)
    first_ms = 1e3 * figures["verdict_after_first_impact_s"]["p95"]
    add(
        "verdict after the first impact, the paper's conditions, 95 %",
        "<= 100 ms",
        f"{first_ms:.0f} ms",
        first_ms <= 100,
    )
    early_ms = 1e3 * figures["early_inclination"]["verdict_after_first_impact_s"]["largest"]
    add("verdict after the first impact, with xi from it, all", "<= 100 ms", f"{early_ms:.0f} ms", early_ms <= 100)
    rough = next(row for row in figures["robustness"] if row["variant"] == FRICTION)
    for (group, title), name in itertools.product(titles.items(), ("medium", "wide")):
        B, found = tolerances_deg[name], rough[group][name]
        band = found["band_deg"]
        ambiguous = max(found.get("ambiguous_deg", [np.inf]))
        add(
            f"{tolerance_text(B)} with friction of contact and joints, {title}, held out",
            "band, <= 2 deg ambiguous",
            f"{band_text(band)}, {ambiguous:g} deg",
            band is not None and band[0] <= -B and band[1] >= B and ambiguous <= 2,
        )
    return rows


def tolerance_text(B: float) -> str:
    """Return the inclinations up to B [deg] as text."""
    return f"±{B:g} deg" if B else "0 deg"


def band_text(band: list[float] | None) -> str:
    """Return a band as text."""
    return "none" if band is None else f"[{band[0]:g}, {band[1]:g}]"


def cells(found: Figures) -> list[str]:
    """Return band, ambiguous width below and above, and share beyond as text."""
    low, high = found["ambiguous_deg"]
    return [band_text(found["band_deg"]), f"{low:g} / {high:g}", f"{100 * found['accepted_beyond']:.2g} %"]
