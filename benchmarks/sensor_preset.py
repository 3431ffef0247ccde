"""Fit the sensors of a simulated Panda to a recording of a real one in free motion, and print them as TOML.

python benchmarks/sensor_preset.py RECORDING "WHERE IT IS FROM" > src/tactful/simulation/presets/panda.toml
"""

import json
import sys

import numpy as np

from tactful import MonitorConfig, Recording
from tactful.calibration import fit_sensors

GEAR_RATIO = np.array([120.0, 120.0, 120.0, 120.0, 80.0, 80.0, 80.0])
"""Of the joints, as the periods of the ripple in recordings tell: 240 and 160 in one turn are two a motor turn."""

if __name__ == "__main__":
    _, recording, origin = sys.argv
    sensors = fit_sensors(Recording.read(recording), MonitorConfig(robot={"model": "panda"}), GEAR_RATIO)
    figures = sensors.model_dump(mode="json", exclude_defaults=True)
    spectra = figures.pop("spectrum")
    figures["provenance"] = f"{sensors.provenance}; {origin}; made by benchmarks/sensor_preset.py"
    for key, value in figures.items():
        print(key, "=", json.dumps(value, ensure_ascii=False))
    for spectrum in spectra:
        lags = ",\n".join(f"  {json.dumps(lag)}" for lag in spectrum["lags"])
        print(f"\n[[spectrum]]\ninnovation = {json.dumps(spectrum['innovation'])}\nlags = [\n{lags},\n]")
