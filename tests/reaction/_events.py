"""Events as a monitor tells them."""

from typing import Any

from tactful.monitor import ContactEvent


def told(kind: str = "collision", phase: str = "began", **changes: Any) -> ContactEvent:
    fields: dict[str, Any] = {
        "id": 0,
        "phase": phase,
        "kind": kind,
        "onset_s": 0.0,
        "detected_s": 0.0,
        "end_s": None,
        "link": None,
        "location": None,
        "directions": ("x",),
        "force_n": (-20.0, 0.0, 0.0),
        "peak_force_n": 20.0,
        "torque_ext_nm": (),
        "velocity_m_s": None,
        "confidence": 0.8,
        "evidence": (),
        "sigma_min": 0.3,
        "damped": False,
    }
    return ContactEvent(**fields | changes)
