"""Train the classifier that is part of Tactful on simulated scenes, and hold it against the rules in each, unseen.

python -m benchmarks.classifier FOLDER [MODEL.npz]

FOLDER takes the episodes, about 220 of 3 to 10 s; those that are there are not made again. MODEL.npz takes the model.
"""

import sys
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.progress import track
from rich.table import Table

from benchmarks.classifier._scenes import TAUGHT_BY, Part, parts
from tactful import Recording, __version__
from tactful.classification import FEATURES, KinestheticClassifier, KinestheticConfig, LearnedConfig, Onset
from tactful.learning import Decision, Seen, Training, decisions_of, seen, train

RULES = {
    "floored": KinestheticClassifier(KinestheticConfig(rule="floored")),
    "angle": KinestheticClassifier(KinestheticConfig(rule="angle")),
}
HABITS = ("since_collision", "from_tip", "rate")
"""Features that say more of a scene than of a contact: when people come, where, and how hard they push."""

Figures = dict[str, float]


@dataclass(frozen=True)
class Note:
    """What a learned classifier sees of an onset, and what the rules say of it."""

    seen: Seen
    rules: dict[str, str]


def note(onset: Onset) -> Note:
    """Take what the classifiers need from an onset."""
    return Note(seen(onset), {name: rule.classify(onset).kind for name, rule in RULES.items()})


def noted(part: Part, number: int) -> list[Decision[Note]]:
    """Return what there is to decide in a part; the same recording in another part is another contact."""
    robot, found = part.config.robot.load(), list[Decision[Note]]()
    for file in track(part.files, description=part.scene, transient=True, disable=not sys.stderr.isatty()):
        wait_s = part.config.fast.decide_until_s
        decisions = decisions_of(Recording.read(file), robot, part.config, note, wait_s=wait_s)
        found += [replace(d, operator=part.scene, contact=(f"{number} {file}", d.contact[1])) for d in decisions]
    return found


def learnable(decision: Decision[Note], wait_s: float) -> Decision[Seen]:
    """Return what is learned from: the onsets in the time that the classifier may take, without habits."""
    habits = [list(FEATURES).index(name) for name in HABITS]
    asks: list[Seen] = []
    for ask in decision.asks:
        if ask.seen.since_s <= wait_s + 5e-4 or not asks:
            features = ask.seen.features.copy()
            features[habits] = np.nan
            asks.append(Seen(features, ask.seen.since_s))
    return Decision(
        truth=decision.truth,
        contact=decision.contact,
        operator=decision.operator,
        after_collision=decision.after_collision,
        asks=tuple(asks),
    )


def told_by_rule(name: str, decision: Decision[Note]) -> str:
    """Return what a rule tells in the end."""
    return next((kind for ask in decision.asks if (kind := ask.rules[name]) != "contact"), "contact")


def figures(told: Sequence[str], decisions: Sequence[Decision[Any]], scene: str) -> Figures:
    """Return the shares of the contacts of a scene that were told rightly when they were found."""
    first: dict[tuple[str, int], tuple[str, str]] = {}
    for kind, decision in zip(told, decisions, strict=True):
        if decision.operator == scene:
            first.setdefault(decision.contact, (kind, decision.truth))
    collisions, cooperations = (
        [kind == truth for kind, truth in first.values() if truth == wanted] for wanted in ("collision", "cooperation")
    )
    return {
        "collisions": len(collisions),
        "cooperations": len(cooperations),
        "accuracy": round(float(np.mean([*collisions, *cooperations])), 4),
        "specificity": round(float(np.mean(collisions)), 4),
        "sensitivity": round(float(np.mean(cooperations)), 4),
    }


def compare(found: list[Decision[Note]]) -> tuple[dict[str, dict[str, Figures]], Training]:
    """Return the figures of every scene and classifier, and the training on all scenes.

    A model is held out by scene: it tells the contacts of one that it has not seen.
    """
    config = LearnedConfig()
    scenes = list(dict.fromkeys(str(decision.operator) for decision in found))
    to_learn = [learnable(decision, config.wait_s) for decision in found]
    made_by = f"tactful {__version__}, python -m benchmarks.classifier"
    about = {"made_by": made_by, "scenes": scenes, "operators": TAUGHT_BY}
    trained = {
        name: train(to_learn, location=name == "learned, with location", config=config, provenance=about)
        for name in ("learned, with location", "learned")
    }
    told: dict[str, Sequence[str]] = {rule: [told_by_rule(rule, decision) for decision in found] for rule in RULES}
    told |= {name: training.told for name, training in trained.items()}
    rows = {scene: {name: figures(kinds, found, scene) for name, kinds in told.items()} for scene in scenes}
    return rows, trained["learned"]


def report(rows: dict[str, dict[str, Figures]], training: Training) -> None:
    """Print the comparison, and what counts most in the model."""
    table = Table("a scene that the model has not seen", "contacts", *next(iter(rows.values())), box=None)
    for scene, row in rows.items():
        counts = row["learned"]
        shares = [[100 * f[key] for key in ("accuracy", "specificity", "sensitivity")] for f in row.values()]
        cells = [f"{accuracy:.1f} ({specific:.0f}, {sensitive:.0f})" for accuracy, specific, sensitive in shares]
        table.add_row(scene, f"{counts['collisions']} + {counts['cooperations']}", *cells)
    console = Console(width=150, highlight=False)
    console.print("told rightly when found, % (collisions, cooperations):")
    console.print(table)
    weights = ", ".join(f"{name} {weight:.2f}" for name, weight in training.importance.items())
    console.print(f"told {1e3 * training.decided_s:.0f} ms after the detection; log odds by feature: {weights}")


def main() -> None:
    """Make the episodes, compare, and train the model on all of them."""
    found = [decision for number, part in enumerate(parts(Path(sys.argv[1]))) for decision in noted(part, number)]
    rows, training = compare(found)
    report(rows, training)
    if len(sys.argv) > 2:
        unseen = {scene: row["learned"] for scene, row in rows.items()}
        replace(training.model, figures={"held_out": "scene", "scenes": unseen}).save(sys.argv[2])
        print(f"saved {sys.argv[2]}")


if __name__ == "__main__":
    main()
