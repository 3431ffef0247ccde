"""The verb that runs the experiments: one function a study."""

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from cyclopts import App
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn
from rich.table import Table
from rich.text import Text

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
    with _progress("compiling the kernels, if need be, and drawing contacts") as (console, progress):
        summary = isolation_study(arm, out, samples=samples, seed=seed, jobs=jobs, progress=progress)
    _print(f"{summary['robot']}, simulated contacts, {summary['noise_nm']:g} Nm", summary)
    console.print(f"[dim]an update takes {_update_us(arm):.0f} us here; saved {out}[/dim]", soft_wrap=True)


@study.command
def aim_aware(
    *,
    robot: Literal["planar", "panda"] = "planar",
    grid: Literal["paper", "fine"] = "paper",
    seed: int = 0,
    jobs: int = 2,
    scheduler: str | None = None,
    out: Path,
) -> None:
    """Measure which impacts on an inclined surface are told as expected, as the aim-aware paper does.

    Planar: simulates the 7161 impacts of the paper with an assumed arm, and judges them with the published settings
    and with tuned ones, both also on held-out impacts. Panda: repeats the paper's experiment with a simulated arm, with
    a reference from recorded nominal runs and one from the impact map. Writes report.html, summary.json, tables.md, the
    figures 6 and 7, or 8, of the paper and what every impact would need to be accepted; both may share a folder.

    Args:
        robot: The paper's simulation with a planar arm, or its experiment with a Panda (needs the extra mujoco).
        grid: Inclinations of the planar arm every 1 deg, as in the paper, or every 0.25 deg.
        seed: What the tuning draws from, and the noise of the sensors.
        jobs: Number of processes.
        scheduler: Address of a Dask scheduler, to work there instead.
        out: Folder for the results.
    """
    from tactful.errors import TactfulError
    from tactful.studies.aim_aware import aim_aware_study, panda_study

    if robot == "panda" and grid != "paper":
        raise TactfulError(f"--grid {grid} is one of the planar arm: leave it out with --robot panda")
    with _progress("compiling the kernels, if need be, and simulating impacts") as (console, progress):
        if robot == "panda":
            summary = panda_study(out, seed=seed, jobs=jobs, scheduler=scheduler, progress=progress)
        else:
            summary = aim_aware_study(out, grid=grid, seed=seed, jobs=jobs, scheduler=scheduler, progress=progress)
    _print(f"{robot} arm, {summary['impacts']} simulated impacts", summary)
    what = "the grid" if robot == "planar" else "all"
    console.print(f"[dim]{summary['cpu_s']:.0f} s of CPU for {what}; saved {out / 'report.html'}[/dim]", soft_wrap=True)


@study.command
def impact_causes(*, learn: int = 160, test: int = 60, seed: int = 0, out: Path) -> None:
    """Measure how well it is told what went wrong with a planned impact, and how the surface is inclined.

    Simulates impacts of a planar arm with one thing wrong at a time, learns their causes from some and measures on
    others, for plans that count on a fixed surface, on friction, or on an object that gives way; writes summary.json,
    tables.md, and a model for each (causes-fixed.npz and so on, for `tactful monitor --causes`).

    Args:
        learn: Runs of each cause to learn from, half of them with noisy sensors.
        test: Runs of each cause to measure on, with clean and with noisy sensors each.
        seed: What all runs are drawn from.
        out: Folder for the results.
    """
    from tactful.studies.impact_causes import impact_causes_study

    with _progress("compiling the kernels, if need be, and simulating impacts") as (console, progress):
        summary = impact_causes_study(out, learn=learn, test=test, seed=seed, progress=progress)
    _print("planar arm, simulated impacts with one thing wrong", summary)
    console.print(f"[dim]saved {out}[/dim]", soft_wrap=True)


@study.command
def reactions(*, samples: int = 40, seed: int = 0, jobs: int = 2, out: Path) -> None:
    """Measure what reactions to collisions are worth: peak force and time in contact against no reaction.

    A simulated Panda runs into a post; every collision is met by every reaction. Writes summary.json and tables.md.

    Args:
        samples: Number of collisions.
        seed: What they are drawn from.
        jobs: Number of processes.
        out: Folder for the results.
    """
    from tactful.studies.reactions import reactions_study

    with _progress("compiling the kernels, if need be, and running into posts") as (console, progress):
        summary = reactions_study(out, samples=samples, seed=seed, jobs=jobs, progress=progress)
    _print(f"panda, {summary['collisions']} simulated collisions", summary)
    console.print(f"[dim]saved {out}[/dim]", soft_wrap=True)


@study.command
def kinesthetic(*, episodes: int = 180, seed: int = 0, jobs: int = 2, scheduler: str | None = None, out: Path) -> None:
    """Repeat the experiment of the kinesthetic paper: which contacts are told as collision, and which as help.

    Simulates episodes of a Panda that is to insert a peg, with collisions and people who help, and runs the paper's
    monitor and the fast one with a learned classifier over them. Writes report.html, summary.json, tables.md and
    figures. A call that was interrupted is gone on with by the next one with the same folder.

    Args:
        episodes: Episodes of the evaluation; the sets for tuning, training and false alarms follow.
        seed: What everything is drawn from.
        jobs: Number of processes, where there is no scheduler.
        scheduler: Address of a Dask scheduler whose workers see the folder, as tcp://localhost:8786.
        out: Folder for the results.
    """
    from tactful.studies.kinesthetic import kinesthetic_study

    with _progress("compiling the kernels, if need be, and simulating episodes") as (console, progress):
        summary = kinesthetic_study(
            out, episodes=episodes, seed=seed, jobs=jobs, scheduler=scheduler, progress=progress
        )
    _print(f"panda with a peg, {summary['best']['contacts']} simulated contacts", summary)
    console.print(f"[dim]saved {out / 'report.html'}[/dim]", soft_wrap=True)


@study.command
def teaching(*, seeds: int = 60, seed: int = 0, jobs: int = 2, classifier: str = "learned", out: Path) -> None:
    """Measure how often an arm inserts its peg before and after one correction by hand.

    References that fail are executed; the monitor tells the collision and the hand that helps, online; what the hand
    shows is merged into the reference, and the next execution gets no help. With clean sensors and with those of a
    real Panda; the monitors are calibrated first, on free motion of the same simulated arm. Writes summary.json,
    tables.md and figures.

    Args:
        seeds: Executions to try, with each preset of the sensors.
        seed: What everything is drawn from.
        jobs: Number of processes.
        classifier: What tells the kinds of contacts: learned, rules, or a model of `tactful train`.
        out: Folder for the results.
    """
    from tactful.studies.teaching import teaching_study

    with _progress("calibrating the monitors, and teaching") as (console, progress):
        summary = teaching_study(out, seeds=seeds, seed=seed, jobs=jobs, classifier=classifier, progress=progress)
    table = Table(box=None, pad_edge=False, header_style="dim")
    for heading in ("sensors", "peg inserted before", "after one correction"):
        table.add_column(heading)
    for sensors, figures in summary["presets"].items():
        shares = (figures["all"][key] for key in ("before", "after"))
        cells = (f"{100 * s['value']:.0f} % [{100 * s['low']:.0f}, {100 * s['high']:.0f}]" for s in shares)
        table.add_row(sensors, *(Text(cell) for cell in cells))
    Console(highlight=False).print(table)
    console.print(f"[dim]saved {out}[/dim]", soft_wrap=True)


@contextmanager
def _progress(text: str) -> Iterator[tuple[Console, Callable[[float], None]]]:
    """Show a bar on a terminal, and give the console and the function that takes the share that is done."""
    console = Console(stderr=True, highlight=False)
    columns = (TextColumn("{task.description}"), BarColumn(), TextColumn("{task.percentage:3.0f} %"))
    with Progress(
        *columns, TimeRemainingColumn(), console=console, transient=True, disable=not console.is_terminal
    ) as bar:
        task = bar.add_task(text, total=1.0)
        yield console, lambda share: bar.update(task, completed=share)


def _print(title: str, summary: dict[str, Any]) -> None:
    table = Table(box=None, pad_edge=False, header_style="dim")
    table.add_column(title)
    for heading in ("wanted", "reached"):
        table.add_column(heading, justify="right")
    table.add_column("")
    for row in summary["targets"]:
        reached = row["reached"]
        if not isinstance(reached, str):
            reached = "-" if reached is None else f"{reached:.3g}"
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
