"""The verb that tunes a classifier with a guarantee."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter
from rich.console import Console
from rich.table import Table

from tactful.cli._labelled import check_output, decisions_in, settings_of
from tactful.cli._tune_aim_aware import tune_aim_aware
from tactful.errors import TactfulError

if TYPE_CHECKING:
    from tactful.learning import Tuning

EXIT_NO_GUARANTEE = 1
_SHOWN = 7


def tune(
    path: Annotated[list[Path] | None, Parameter(negative_iterable=())] = None,
    /,
    *,
    output: Annotated[Path | None, Parameter(name=["--output", "-o"])] = None,
    max_misclassified_collisions: float = 0.05,
    confidence: float = 0.95,
    robot: str | None = None,
    tip: str | None = None,
    config: Path | None = None,
    classifier: str | None = None,
    mapping: Path | None = None,
    aim_aware: bool = False,
    plan: Path | None = None,
    tolerance_deg: float = 2.0,
    tilt: bool = False,
    trials: int = 40,
    seed: int = 0,
) -> int:
    """Choose the threshold of a classifier so that few collisions are taken for cooperation, with a guarantee.

    Of the values of gamma, or of the probability, that keep the bound on the share of collisions that are told as
    cooperation, when they are found or later, it takes the one that tells the most contacts rightly. The bound holds
    with the stated confidence, whatever the number of contacts, for collisions like those of the recordings; use others
    than those that the classifier was trained on. Where no value keeps it, it says how many more events it would take.

    With --aim-aware it chooses the settings for planned impacts instead, so that every impact that is labelled
    `expected_impact` is accepted and as few as can be that are labelled `unexpected_impact`; it holds a third of them
    out to measure on. Without recordings it simulates impacts of a planar arm on inclined surfaces.

    Args:
        path: Recordings with labels, or folders of them, as `tactful evaluate` reads them.
        output: Where to write the settings with the value that was chosen, a TOML file.
        max_misclassified_collisions: The bound: largest share of collisions that may be taken for cooperation.
        confidence: The probability with which the bound holds.
        robot: The arm: a name from `tactful robots`, or an MJCF or URDF file.
        tip: The frame at which the force is estimated: a site or link of the robot.
        config: Settings to start from, a TOML file.
        classifier: What is tuned: a model that `tactful train` wrote, or `kinesthetic`. By default what the settings
            name.
        mapping: What the columns of the recordings mean, a TOML file.
        aim_aware: Tune to planned impacts.
        plan: The plan of the impact, as ImpactPlan.save writes it; without, RUN.plan.npz beside each recording RUN.
        tolerance_deg: Without recordings, the inclination that is to be accepted, both ways.
        tilt: Whether the rotation of the tool is judged, too.
        trials: How many envelopes and bounds are tried for planned impacts.
        seed: What is held out, simulated and tried is drawn from it.

    Returns:
        0, or 1 if no value keeps the bound; then nothing is written.
    """
    from tactful.learning import Candidates
    from tactful.learning import tune as choose

    if output is not None:
        check_output(output)
    if not path and not aim_aware:
        raise TactfulError("which recordings? Name labelled ones, or folders of them")
    for name, share in (("--max-misclassified-collisions", max_misclassified_collisions), ("--confidence", confidence)):
        if not 0 < share < 1:
            raise TactfulError(f"{name} is {share:g}: it has to lie between 0 and 1")
    if aim_aware:
        return tune_aim_aware(
            path or [],
            output,
            plan=plan,
            tolerance_deg=tolerance_deg,
            tilt=tilt,
            trials=trials,
            seed=seed,
            confidence=confidence,
            robot=robot,
            tip=tip,
            config=config,
            mapping=mapping,
        )
    assert path is not None
    settings = settings_of(config, robot, tip)
    if classifier is not None:
        settings = settings.model_copy(update={"classifier": classifier})
    candidates = Candidates.of(settings.load_classifier())
    decisions = decisions_in(path, settings, mapping, candidates.ask, settings.fast.decide_until_s)
    tuning = choose(decisions, candidates, limit=max_misclassified_collisions, confidence=confidence)
    _report(tuning)
    if tuning.chosen is None:
        return EXIT_NO_GUARANTEE
    if output is not None:
        tuning.applied_to(settings, folder=output.parent).save(output)
        Console(stderr=True).print(f"[dim]saved {output}[/dim]", highlight=False)
    return 0


def _report(tuning: "Tuning") -> None:
    from tactful.cli._evaluation_tables import percent

    console = Console(highlight=False)
    key = f"{tuning.candidates.section}.{tuning.candidates.key}"
    table = Table(box=None, pad_edge=False, header_style="dim")
    table.add_column(key)
    for heading in ("collisions taken for cooperation", "bound", "sensitivity", ""):
        table.add_column(heading, justify="right")
    count = len(tuning.candidates.values)
    middle = tuning.chosen if tuning.chosen is not None else 0
    begin = max(0, min(middle - _SHOWN // 2, count - _SHOWN))
    for number in range(begin, min(begin + _SHOWN, count)):
        wrong = tuning.misclassified[number]
        note = "chosen" if number == tuning.chosen else "" if number < tuning.certified else "not certified"
        table.add_row(
            f"{tuning.candidates.values[number]:g}",
            f"{wrong.count} of {wrong.total}",
            f"{100 * tuning.bounds[number]:.1f} %",
            percent(tuning.sensitivity[number]),
            note,
            style="bold" if number == tuning.chosen else "",
        )
    console.print(table)
    if tuning.chosen is None:
        console.print(f"no value keeps the bound: {tuning.shortfall}", style="yellow", soft_wrap=True)
        return
    wrong = tuning.misclassified[tuning.chosen]
    console.print(
        f"{key} = {tuning.value:g}: at most {100 * tuning.limit:g} % of collisions like these are taken for "
        f"cooperation, with a confidence of {100 * tuning.confidence:g} % ({wrong.count} of {wrong.total} were)",
        soft_wrap=True,
    )
