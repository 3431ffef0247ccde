"""The verb that calibrates a monitor."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter
from rich.console import Console
from rich.table import Table

from tactful.cli._settings import load_settings

if TYPE_CHECKING:
    from tactful.calibration import Calibration, Fit
    from tactful.monitor import MonitorConfig
    from tactful.recordings import Recording


def calibrate(
    file: Annotated[list[Path], Parameter(negative_iterable=())],
    /,
    *,
    output: Annotated[Path, Parameter(name=["--output", "-o"])],
    robot: str | None = None,
    tip: str | None = None,
    config: Path | None = None,
    mapping: Path | None = None,
    payload: tuple[float, float, float, float] | None = None,
    false_alarms_per_hour: float = 0.125,
    cross_validate: float | None = None,
) -> None:
    """Calibrate a monitor from motion of the arm in which nothing touches it.

    It finds the inertial figures of the links, the payload, bias and friction that explain the torque, and from what is
    left of it on held-out time the noise and the thresholds for a stated rate of false alarms. The result is a
    configuration for `tactful monitor --config`.

    Args:
        file: Recordings with joint position, velocity and torque, a few seconds or more, of all joints in motion; or
            with the robot's own external torque, or a wrench, of which the noise and the thresholds are found.
        output: Where to write the configuration, a TOML file.
        robot: The arm: a name from `tactful robots`, or an MJCF or URDF file.
        tip: The frame at which the force is estimated: a site or link of the robot.
        config: Settings to start from, a TOML file.
        mapping: What the columns of the recordings mean, a TOML file.
        payload: Mass [kg] and centre of mass in the tip frame [m, m, m] of the payload. Found by default.
        false_alarms_per_hour: What the thresholds are for; by default one in 8 hours.
        cross_validate: Also calibrate from each window of so many seconds, a second apart, and say what the result does
            in the rest of its recording.
    """
    from tactful.calibration import calibrate as find
    from tactful.errors import TactfulError
    from tactful.recordings import Recording

    settings = load_settings(config, robot=robot, tip=tip)
    if not output.parent.is_dir():
        raise TactfulError(f"{output}: there is no folder {output.parent}")
    with Console(stderr=True).status("calibrating; the first time kernels are compiled, which takes about a minute"):
        recordings = [Recording.read(path, mapping=mapping) for path in file]
        known = None if payload is None else (payload[0], payload[1:])
        found = find(recordings, settings, payload=known, false_alarms_per_hour=false_alarms_per_hour)
    found.save(output)
    _report(found, output)
    if cross_validate is not None:
        _cross_validate(recordings, settings, cross_validate)


def _cross_validate(recordings: "list[Recording]", settings: "MonitorConfig", window_s: float) -> None:
    from tactful.calibration import cross_validate

    console = Console(highlight=False)
    table = Table(box=None, pad_edge=False, header_style="dim", padding=(0, 2, 0, 0))
    for heading in (
        "calibrated from [s]",
        "residual in the rest, of the nominal arm's",
        "mean",
        "false alarms",
        "level",
    ):
        table.add_column(heading, justify="left" if heading == "calibrated from [s]" else "right")
    for recording in recordings:
        for split in cross_validate(recording, settings, window_s=window_s):
            ratio = split.after_nm / split.before_nm
            table.add_row(
                f"{split.start_s:.1f}-{split.end_s:.1f}",
                " / ".join(f"{value:.2f}" for value in ratio),
                f"{ratio.mean():.2f}",
                f"{len(split.false_alarms_s)} in {split.monitored_s:.1f} s",
                f"{split.highest_level:.2f}",
            )
    console.print(table)
    console.print("level: the highest in the rest, over its threshold", style="dim")


def _report(found: "Calibration", output: Path) -> None:
    console = Console(highlight=False)
    if found.fit is None:
        _report_external(found, console)
    else:
        _report_fit(found, found.fit, console)
    for mode, items, unit in (("fast", found.thresholds["fast"], ""), ("paper", found.thresholds["frequency"], " [N]")):
        levels = ", ".join(f"{item.value:.3g} ({item.low:.3g}-{item.high:.3g})" for item in items)
        console.print(f"thresholds{unit}, {mode}: {levels}")
    console.print(
        found.thresholds["fast"][0].statement, style="yellow" if not found.thresholds["fast"][0].supported else ""
    )
    for sentence in found.not_excited:
        console.print(sentence, style="dim")
    console.print(f"saved {output}", style="dim")


def _report_external(found: "Calibration", console: Console) -> None:
    config = found.config
    what = "external torque [Nm]" if config.source == "tau_ext" else "wrench [N, Nm]"
    console.print(f"{what}, {found.duration_s:.1f} s without contact at {config.rate_hz:g} Hz")
    for name, values in (("mean", config.provenance["mean"]), ("RMS about it", found.after_nm)):
        console.print(f"{name}: {', '.join(f'{value:.3g}' for value in values)}")


def _report_fit(found: "Calibration", fit: "Fit", console: Console) -> None:
    robot, sd = fit.robot, fit.sd
    console.print(f"[bold]{robot.title}[/bold], {found.duration_s:.1f} s of free motion at {found.config.rate_hz:g} Hz")
    table = Table(box=None, pad_edge=False, header_style="dim", padding=(0, 2, 0, 0))
    table.add_column("joint", no_wrap=True)
    for heading in ("before", "held out", "bias [Nm]", "Coulomb [Nm]", "viscous [Nms]"):
        table.add_column(heading, justify="right", no_wrap=True)
    for i, name in enumerate(robot.joint_names):
        ratio = found.after_nm[i] / found.before_nm[i]
        table.add_row(
            name,
            f"{found.before_nm[i]:.3f}",
            f"{found.after_nm[i]:.3f} ({ratio:.0%})",
            f"{fit.bias[i]:+.3f} ± {sd['bias'][i]:.3f}",
            f"{fit.coulomb[i]:.3f} ± {sd['coulomb'][i]:.3f}",
            f"{fit.viscous[i]:.3f} ± {sd['viscous'][i]:.3f}",
        )
    console.print(table)
    if fit.payload_kg:
        x, y, z = fit.payload_com_m
        spread = f" ± {sd['payload'][0]:.2g}" if len(sd["payload"]) else ""
        console.print(f"payload: {fit.payload_kg:.3g}{spread} kg at ({x:.3f}, {y:.3f}, {z:.3f}) m in {robot.tip}")
    else:
        console.print("payload: none seen")
    console.print(
        f"links: {fit.determined:.0f} of {10 * robot.n} combinations of inertial figures came from the motion, the "
        "others are nominal"
    )
    observer = found.config.observer
    if observer.velocity == "position":
        clock = f" by the robot's clock of {observer.clock_s * 1e3:g} ms" if observer.clock_s else ""
        console.print(f"velocity: from the position{clock}, which is less noisy than the measured one")
