"""`tactful robots`: the arms that are built in."""

import json as jsonlib

from rich import box
from rich.console import Console
from rich.table import Table

from tactful.robots import Robot


def robots(*, json: bool = False) -> None:
    """List the built-in robots. Any other arm loads from an MJCF or URDF file.

    Args:
        json: Print one JSON object a line instead of a table.
    """
    known = [Robot.load(name) for name in Robot.names()]
    if json:
        for robot in known:
            print(jsonlib.dumps(_facts(robot)))
        return
    table = Table(box=box.SIMPLE_HEAD, show_edge=False)
    table.add_column("name", style="bold", no_wrap=True)
    table.add_column("robot, source of its figures", overflow="fold")
    for heading in ("joints", "mass\n[kg]", "reach\n[m]"):
        table.add_column(heading, justify="right")
    table.add_column("tip frames")
    table.add_column("torque\nsensor")
    for robot in known:
        facts = _facts(robot)
        table.add_row(
            robot.name,
            f"{robot.title}\n[dim]{robot.source}[/dim]",
            str(robot.n),
            f"{facts['mass_kg']:.1f}",
            f"{robot.reach_m:.3f}",
            "\n".join(f"[bold]{frame}[/bold]" if frame == robot.tip else frame for frame in robot.frames),
            robot.torque_sensor,
        )
    console = Console()
    console.print(table)
    console.print("Masses are those of the moving links. The tip in bold is the default; --tip names another.")


def _facts(robot: Robot) -> dict[str, object]:
    return {
        "name": robot.name,
        "title": robot.title,
        "joints": robot.n,
        "mass_kg": round(float(robot.mass.sum()), 6),
        "reach_m": robot.reach_m,
        "frames": list(robot.frames),
        "tip": robot.tip,
        "torque_sensor": robot.torque_sensor,
        "source": robot.source,
    }
