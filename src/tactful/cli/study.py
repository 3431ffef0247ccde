"""The verb that runs the experiments: one function a study."""

import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cyclopts import App
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn
from rich.table import Table

if TYPE_CHECKING:
    from tactful.robots import Robot

study = App(name="study", help="Run an experiment in simulation and write its tables and figures.")


@study.default
def _studies() -> None:
    """Run an experiment in simulation and write its tables and figures."""
    from tactful.cli._app import app

    app.help_print(["study"])


@study.command
def isolation(*, robot: str = "panda", samples: int = 4000, seed: int = 0, jobs: int = 2, out: Path) -> None:
    """Measure how well a contact's link, point and force are told from the joint torques alone.

    Writes summary.json, tables.md and figures. The result depends on the seed and the number of samples alone.

    Args:
        robot: The arm: a name from `tactful robots`, or an MJCF or URDF file with collision shapes.
        samples: Contacts for the tables of links; the other tables take a fraction of it.
        seed: What the contacts are drawn from.
        jobs: Number of processes.
        out: Folder for the results.
    """
    from tactful.robots import Robot
    from tactful.studies.isolation import isolation_study

    arm = Robot.load(robot)
    console = Console(stderr=True, highlight=False)
    columns = (TextColumn("{task.description}"), BarColumn(), TextColumn("{task.percentage:3.0f} %"))
    with Progress(
        *columns, TimeRemainingColumn(), console=console, transient=True, disable=not console.is_terminal
    ) as bar:
        task = bar.add_task("compiling the kernels, if need be, and drawing contacts", total=1.0)
        summary = isolation_study(
            arm, out, samples=samples, seed=seed, jobs=jobs, progress=lambda share: bar.update(task, completed=share)
        )
    _print(summary)
    console.print(f"[dim]an update takes {_update_us(arm):.0f} us here; saved {out}[/dim]", soft_wrap=True)


def _print(summary: dict[str, Any]) -> None:
    table = Table(box=None, pad_edge=False, header_style="dim")
    table.add_column(f"{summary['robot']}, simulated contacts, {summary['noise_nm']:g} Nm")
    for heading in ("wanted", "reached"):
        table.add_column(heading, justify="right")
    table.add_column("")
    for row in summary["targets"]:
        reached = "-" if row["reached"] is None else f"{row['reached']:.3g}"
        table.add_row(row["what"], row["target"], reached, "" if row["met"] else "[yellow]missed[/yellow]")
    Console(highlight=False).print(table)


def _update_us(arm: "Robot") -> float:
    """Return the median time of an update on random contacts [us]."""
    import numpy as np

    from tactful.isolation import Isolator
    from tactful.studies.isolation import Draw

    isolator, draw, times = Isolator(arm), Draw(arm, np.random.default_rng(0)), []
    for _ in range(300):
        q, contact = draw.posed_contact()
        begin = time.perf_counter()
        isolator.locate(q, contact.torque_nm)
        times.append(time.perf_counter() - begin)
    return 1e6 * float(np.median(times))
