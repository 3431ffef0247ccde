"""The figures of the experiment with an arm on the bench, in tables."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from tactful.studies._report import Table
from tactful.studies.aim_aware._targets import band_text, cells

Figures = dict[str, Any]

_REFERENCES: Mapping[str, str] = {"data_driven": "recorded", "model_based": "impact map"}
_GROUPS: Mapping[str, str] = {"table2": "Tab. 2 verbatim", "tuned": "tuned", "tilt": "tuned, with the tilt"}
_SETTINGS: Mapping[str, str] = {
    "m_max": "m_max",
    "m_c": "m_c",
    "a_per_s": "a [1/s]",
    "epsilon_rad": "epsilon [rad]",
    "zeta_s": "zeta [s]",
    "xi_s": "xi [s]",
    "e_m_rad_s": "e_m [rad/s]",
    "iota_s": "iota [s]",
}


def bench_bands_table(panda: Figures) -> Table:
    """Return the bands of every set with either reference, beside what the paper says."""
    rows = []
    for group, title in _GROUPS.items():
        for name in dict.fromkeys(name for reference in _REFERENCES for name in panda[reference][group]):
            published = panda["published_band_deg"].get(name)
            found = [panda[reference][group].get(name) for reference in _REFERENCES]
            shown = [cell for x in found for cell in (cells(x) if x else ["not to be tuned", "", ""])]
            rows.append((f"{title}, {name}", band_text(published) if published else "-", *shown))
    heading = [
        f"{title}: band [deg]" if k == 0 else ("", "ambiguous", "beyond")[k]
        for title in _REFERENCES.values()
        for k in range(3)
    ]
    return Table(("set", "paper: band", *heading), rows)


def settings_table(panda: Figures) -> Table:
    """Return Tab. 2 beside the tuned sets."""
    columns = [("table2", "data_driven", name) for name in ("strict", "wide")]
    columns += [("tuned", reference, name) for reference in _REFERENCES for name in panda[reference]["tuned"]]
    heading = [
        f"Tab. 2, {name}" if group == "table2" else f"{name}, {_REFERENCES[reference]}"
        for group, reference, name in columns
    ]
    rows = []
    for key, title in _SETTINGS.items():
        values = [panda[reference][group][name]["settings"][key] for group, reference, name in columns]
        rows.append((title, *(f"{v:.3g}" for v in values)))
    return Table(("setting", *heading), rows)


def bench_variants_table(panda: Figures) -> Table:
    """Return what Tab. 2 does where something differs from the assumed bench."""
    rows = []
    usual = {reference: panda[reference]["table2"] for reference in _REFERENCES}
    for row in ({"variant": "as assumed", **usual}, *panda["variants"]):
        shown = [", ".join(cells(row[r][name])) for r in _REFERENCES for name in ("strict", "wide")]
        rows.append((row["variant"], *shown))
    heading = [f"{name}, {title}" for title in _REFERENCES.values() for name in ("strict", "wide")]
    return Table(("Tab. 2 verbatim: band, ambiguous, beyond", *heading), rows)


def bench_intro(panda: Figures) -> list[str]:
    """Return what the figures are of."""
    bench = panda["bench"]
    tool, task, cell = bench["tool"], bench["task"], bench["cell"]
    return [
        f"{panda['impacts']} impacts, as in the paper: approaches 100 to 130 deg, platform inclined by -20 to 20 deg; "
        f"{panda['nominal_runs_per_approach']} other nominal runs of each approach make its recorded reference, "
        f"{panda['training_impacts']} others are tuned on. {panda['cpu_s']:.0f} s of CPU for all of it.",
        "Taken from the paper: arm, angles, place and height of the impact, inclinations, parameters of the "
        "classifier. Assumed: "
        f"{task['speed_m_s']:g} m/s at the impact, a flat tool of {tool['mass_kg']:g} kg that touches with four feet "
        f"{200 * tool['half_length_m']:g} x {200 * tool['half_width_m']:g} cm apart, contact friction "
        f"{cell['friction']:g} that no plan knows, an inelastic contact of {1e3 * cell['contact_time_s']:g} ms, "
        "elastic joints of 14 and 9 kNm/rad that are damped by K times 1 ms, motors compensated for friction, the "
        "controller's gains, K_O and r_b.",
        "Sensors: noise, ripple, friction in the torque and offsets as measured on a real Panda. The model that plans "
        "and monitors differs from the arm (masses 2 %, centres of mass 2 mm), the platform from its setting from run "
        f"to run (height {1e3 * bench['height_sd_m']:g} mm, inclination {bench['inclination_sd_deg']:g} deg).",
        "Inclination from the tool at the verdict, from -4 to 8 deg: mean error "
        f"{panda['inclination_mae_deg']:.2g} deg, worst {panda['inclination_worst_deg']:.2g} deg.",
    ]
