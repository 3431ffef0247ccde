"""What the page says about a contact, and in which colour."""

from __future__ import annotations

import html
import math

from tactful.monitor import ContactEvent, MonitorConfig

COLOURS = {
    "free": "#5c7080",
    "contact": "#e8850c",
    "collision": "#d92d20",
    "cooperation": "#12925a",
    "expected_impact": "#2166c4",
    "unexpected_impact": "#8a3ab9",
}

_SLOW_M_S = 0.01


def rgb(kind: str) -> tuple[int, int, int]:
    """Return the colour of a kind as three numbers."""
    colour = COLOURS[kind]
    return int(colour[1:3], 16), int(colour[3:5], 16), int(colour[5:7], 16)


def kind_of(event: ContactEvent) -> str:
    """Return the kind as one reads it."""
    return event.kind.replace("_", " ")


def small(text: str) -> str:
    """Return HTML of a remark, in line with the fields of the page."""
    return f"<div style='color:#5c7080;font-size:12.5px;line-height:1.45;margin:0 9px 6px'>{text}</div>"


def onset(event: ContactEvent) -> str:
    """Return when a contact began, as the list tells it."""
    return f"{event.onset_s:.2f} s"


def headline(event: ContactEvent) -> str:
    """Return a line for the list of contacts."""
    where = event.link or (event.location.region.replace("_", " ") if event.location else "")
    parts = [onset(event), kind_of(event), f"{event.peak_force_n:.0f} N", where]
    return "  ·  ".join(part for part in parts if part)


def reason(event: ContactEvent) -> str:
    """Return where the force acts, how it stands to the motion, and how sure the kind is."""
    if event.kind == "contact":
        return f"contact: force {_axis(event.force_n)}, not classified yet"
    return f"{kind_of(event)}: force {_axis(event.force_n)} {_to_motion(event)}, p = {event.confidence:.2f}"


def _axis(force_n: tuple[float, ...]) -> str:
    """Return the axis of the base along which a force (3,) is largest."""
    size, axis = max((abs(value), axis) for axis, value in enumerate(force_n[:3]))
    return f"along {'-' if force_n[axis] < 0 else '+'}{'xyz'[axis]}" if size else "unknown"


def _to_motion(event: ContactEvent) -> str:
    force, velocity = event.force_n[:3], event.velocity_m_s
    if velocity is None or math.hypot(*velocity[:3]) < _SLOW_M_S or not math.hypot(*force):
        return "at rest"
    along = sum(f * v for f, v in zip(force, velocity, strict=False))
    cosine = along / (math.hypot(*force) * math.hypot(*velocity[:3]))
    return "with the motion" if cosine > 0.5 else "against the motion" if cosine < -0.5 else "across the motion"


def evidence_card(event: ContactEvent) -> str:
    """Return all that is known of a contact, as HTML."""
    colour = COLOURS[event.kind]
    decided = event.decision.partition(": ")[2] or event.decision
    rows = [("decided by", decided)] if decided else []
    rows += [
        ("onset", f"{event.onset_s:.3f} s, detected {1e3 * (event.detected_s - event.onset_s):.0f} ms later"),
        ("lasted", "still there" if event.end_s is None else f"{event.end_s - event.onset_s:.2f} s"),
        ("force at the tip", f"{_vector(event.force_n)} N, at most {event.peak_force_n:.1f} N"),
    ]
    if event.velocity_m_s is not None:
        rows.append(("velocity before", f"{_vector(event.velocity_m_s, 2)} m/s"))
    if (where := event.location) is not None:
        low, high = where.magnitude_interval_n
        link = f"{where.link} (p = {where.confidence:.2f})" + (", not sure" if where.ambiguous else "")
        rows.append(("where", link))
        rows.append(("force there", f"{where.magnitude_n:.0f} N, {low:.0f} to {high:.0f} N"))
    if event.damped:
        rows.append(("near a singularity", "the force is too small along the lost direction"))
    rules = "".join(
        f"<tr><td>{_e(item.rule.replace('_', ' '))}</td><td style='text-align:right'>{_number(item.value)}</td>"
        f"<td style='text-align:right'>{_number(item.threshold)}</td></tr>"
        for item in event.evidence
    )
    table = (
        "<table style='width:100%;margin-top:6px;border-top:1px solid #dde3e8;font-size:11.5px'>"
        "<tr style='color:#7b8a97'><td>rule</td><td style='text-align:right'>value</td>"
        f"<td style='text-align:right'>threshold</td></tr>{rules}</table>"
        if rules
        else ""
    )
    lines = "".join(
        f"<tr><td style='color:#7b8a97;padding-right:10px;white-space:nowrap'>{_e(name)}</td><td>{_e(text)}</td></tr>"
        for name, text in rows
    )
    return (
        f"<div data-tactful='evidence' style='border-left:4px solid {colour};margin:0 9px;padding:2px 0 2px 10px;"
        f"font-size:12.5px;line-height:1.45'><b style='color:{colour}'>{_e(reason(event))}</b>"
        f"<table style='margin-top:4px'>{lines}</table>{table}</div>"
    )


def calibration(config: MonitorConfig, factor: float) -> str:
    """Return what is known of the rate of false alarms with thresholds `factor` times those of the configuration."""
    rate = config.provenance.get("false_alarms_per_hour")
    if not isinstance(rate, int | float):
        return "Rate of false alarms: not calibrated. `tactful calibrate` sets thresholds for a stated rate."
    per_hour = f"{rate:.3g} false alarms per hour"
    if math.isclose(factor, 1.0):
        statement = str(config.provenance.get("threshold", "")).strip()
        return f"Calibrated for {per_hour}{': ' + statement if statement else ''}."
    if factor > 1:
        return f"Above the calibrated thresholds: fewer than {per_hour}."
    return f"Below the calibrated thresholds: more than {per_hour}."


def _vector(values: tuple[float, ...], digits: int = 1) -> str:
    return "(" + ", ".join(f"{value:.{digits}f}" for value in values) + ")"


def _number(value: float | None) -> str:
    return "–" if value is None or not math.isfinite(value) else f"{value:.3g}"


def _e(text: str) -> str:
    return html.escape(text)
