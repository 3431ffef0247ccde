"""Calibrate the monitors of the simulated arms that come with Tactful: that of the source `sim`, and that of the demo.

Writes live/sources/sim.toml and simulation/presets/clean-monitor.toml: `python -m benchmarks.sim_config`, three minutes
of robot time.
"""

from importlib import resources
from pathlib import Path

import numpy as np
import tomli_w
from scipy.spatial.transform import Rotation

from tactful import MonitorConfig, Recording
from tactful.calibration import calibrate
from tactful.control import CartesianImpedance, MinimumJerkPath, Pose
from tactful.live.sources.sim import CONFIG, SENSORS
from tactful.simulation import SensorConfig, workshop
from tactful.studies.teaching import calibrated

DURATION_S = 120.0


def exciting_path(start: Pose, rng: np.random.Generator) -> MinimumJerkPath:
    """Return a way through poses in all of the room about the table: where a hand may lead the arm."""
    stops = [(0.0, start)]
    while stops[-1][0] < DURATION_S:
        position = rng.uniform([0.35, -0.35, 0.25], [0.60, 0.35, 0.65])
        rotation = Rotation.from_rotvec(rng.uniform(-0.5, 0.5, 3)).as_matrix() @ start.rotation
        stops.append((stops[-1][0] + rng.uniform(1.2, 2.4), Pose(rotation, position)))
    return MinimumJerkPath(stops)


def main() -> None:
    """Let the arm go about untouched, and calibrate with what its sensors said."""
    rng = np.random.default_rng(1)
    shop = workshop(rng, sensors=SensorConfig.preset(SENSORS))
    controller = CartesianImpedance(shop.cell.robot, posture=shop.posture)
    shop.move([3.0, 0.0, 0.3])
    samples = list(shop.cell.run(controller, exciting_path(shop.plan(0.0), rng).pose, DURATION_S))
    t, q, dq, tau = (np.array(column) for column in zip(*samples, strict=True))
    recording = Recording(
        t=t, channels={"q": q, "dq": dq, "tau": tau}, source="the workshop, untouched", format="simulation"
    )
    _write(CONFIG, calibrate([recording], MonitorConfig(robot={"model": "panda"})).config)
    with resources.as_file(resources.files("tactful.simulation") / "presets" / "clean-monitor.toml") as file:
        _write(file, calibrated("clean", seed=0))


def _write(file: Path, config: MonitorConfig) -> None:
    file.write_text(tomli_w.dumps(config.model_dump(mode="json", exclude_defaults=True, exclude_none=True)))
    print(f"{file.name}: {config.provenance['threshold']}")


if __name__ == "__main__":
    main()
