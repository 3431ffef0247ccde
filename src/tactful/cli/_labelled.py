"""Labelled recordings for the verbs that learn from them."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

from tactful.cli._settings import load_settings
from tactful.errors import TactfulError

if TYPE_CHECKING:
    from tactful.classification import Onset
    from tactful.learning import Decision
    from tactful.monitor import MonitorConfig

T = TypeVar("T")


def settings_of(config: Path | None, robot: str | None, tip: str | None) -> "MonitorConfig":
    """Return the settings of a file, with the arm that is named.

    Raises:
        TactfulError: if no arm is named.
    """
    settings = load_settings(config, robot=robot, tip=tip)
    if settings.robot.model is None:
        raise TactfulError("which arm was recorded? Name it: --robot, one of `tactful robots`, or an MJCF or URDF file")
    return settings


def decisions_in(
    paths: Sequence[Path],
    settings: "MonitorConfig",
    mapping: Path | None,
    extract: "Callable[[Onset], T]",
    wait_s: float,
) -> "list[Decision[T]]":
    """Monitor all recordings that are named and labelled, with a bar, and return what there is to decide."""
    from tactful.evaluation import find_recordings
    from tactful.learning import decisions_of
    from tactful.recordings import Recording

    files = find_recordings(paths)
    arm = settings.robot.load()
    console = Console(stderr=True)
    columns = (TextColumn("{task.description}"), BarColumn(), TextColumn("{task.percentage:3.0f} %"))
    found: list[Decision[T]] = []
    quiet = not console.is_terminal
    with Progress(*columns, TimeRemainingColumn(), console=console, transient=True, disable=quiet) as bar:
        task = bar.add_task("loading the kernels; the first time, compiling them", total=len(files))
        for file in files:
            recording = Recording.read(file, mapping=mapping)
            if recording.labels:
                found += decisions_of(recording, arm, settings, extract, wait_s=wait_s)
            bar.update(task, description=file.name, advance=1)
    return found


def check_output(output: Path) -> None:
    """Refuse an output whose folder is not there, before the work.

    Raises:
        TactfulError: if there is no such folder.
    """
    if not output.parent.is_dir():
        raise TactfulError(f"{output}: there is no folder {output.parent}")
