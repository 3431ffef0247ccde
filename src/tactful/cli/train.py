"""The verb that trains a classifier."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter
from rich.console import Console

from tactful.cli import _evaluation_tables as tables
from tactful.cli._labelled import check_output, decisions_in, settings_of

if TYPE_CHECKING:
    from tactful.learning import Training


def train(
    path: Annotated[list[Path], Parameter(negative_iterable=())],
    /,
    *,
    output: Annotated[Path, Parameter(name=["--output", "-o"])],
    robot: str | None = None,
    tip: str | None = None,
    config: Path | None = None,
    mapping: Path | None = None,
    without_location: bool = False,
) -> None:
    """Train a classifier of collision and cooperation from recordings whose contacts are labelled.

    The monitor runs over the recordings, and the model learns from what could be known when a contact has to be told.
    It is cross-validated by operator: each is told by a model that has not seen them. An operator is what follows
    `operator:` in a note of a recording; where none is named, recordings are held out. All intervals are those of 95 %.

    Use the result with `classifier = "model.npz"` in the settings of the monitor.

    Args:
        path: Recordings with labels, or folders of them, as `tactful evaluate` reads them.
        output: Where to write the model, an .npz file.
        robot: The arm: a name from `tactful robots`, or an MJCF or URDF file.
        tip: The frame at which the force is estimated: a site or link of the robot.
        config: Settings of the monitor that will use it, a TOML file.
        mapping: What the columns of the recordings mean, a TOML file.
        without_location: Learn nothing from where on the arm a contact is.
    """
    from tactful.learning import seen
    from tactful.learning import train as learn

    check_output(output)
    settings = settings_of(config, robot, tip)
    decisions = decisions_in(path, settings, mapping, seen, settings.learned.wait_s)
    about = {"recordings": sorted({decision.contact[0] for decision in decisions}), "robot": settings.robot.model}
    training = learn(decisions, location=not without_location, config=settings.learned, provenance=about)
    training.model.save(output)
    _report(training)
    Console(stderr=True).print(f"[dim]saved {output}[/dim]", highlight=False)


def _report(training: "Training") -> None:
    console = Console(highlight=False)
    console.print(
        f"trained on {training.collisions} collisions and {training.cooperations} cooperations; held out by "
        f"{training.held_out}, told {1e3 * training.decided_s:.0f} ms after the detection:"
    )
    shares = {
        "accuracy": training.accuracy,
        "specificity": training.specificity,
        "sensitivity": training.sensitivity,
        "spurious cooperation": training.spurious,
        **{f"operator {name}": share for name, share in training.per_operator.items()},
    }
    tables.print_shares(shares, console)
    weights = training.importance
    listed = ", ".join(f"{name} {weight:.1f}" for name, weight in list(weights.items())[:6])
    console.print(f"what counts most, in log odds: {listed}", style="dim", soft_wrap=True)
