"""All figures of the study as plain numbers."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tactful import __version__
from tactful.classification import LearnedClassifier
from tactful.monitor import MonitorConfig
from tactful.simulation import EpisodeEntry
from tactful.studies.kinesthetic import _score, _tune
from tactful.studies.kinesthetic._monitors import calibrated_monitor, paper_monitor, trained_monitor
from tactful.studies.kinesthetic._plan import FOLDS, TUNED_BY, VARIATIONS, fold_of
from tactful.studies.kinesthetic._store import Store
from tactful.studies.kinesthetic._targets import targets
from tactful.studies.kinesthetic._watch import Row, Watch, levels, watch

Summary = dict[str, Any]
Monitors = Sequence[MonitorConfig]
"""One for all episodes, or one for each fold."""

TUNED_ON = 28
"""Contacts of each kind that gamma is tuned on, as in the paper."""
EVALUATED_ON = (120, 90)
"""Collisions and cooperations of the paper's evaluation."""


@dataclass(frozen=True)
class Laboratory:
    """The episodes and what runs over them.

    Attributes:
        made: the episodes of every set.
        folder: where their recordings are.
        out: where monitors and models are kept.
        store: what keeps what the monitors said.
    """

    made: Mapping[str, Sequence[EpisodeEntry]]
    folder: Path
    out: Path
    store: Store

    def say(self, name: str, monitors: Monitors, which: str, *, turned: bool = False) -> list[Row]:
        """Return what a monitor says of a set of episodes."""
        return self.store.rows(name, watch, self._tasks(monitors, which, turned=turned))

    def levels(self, which: str) -> list[Row]:
        """Return what every F_th would make of a set."""
        return self.store.rows("levels", levels, self._tasks([paper_monitor()], which))

    def best(self, prefix: str, *, location: bool) -> list[MonitorConfig]:
        """Return the fast monitor, trained on one half of the operators, for the contacts of the other."""
        config = self.calibrated(prefix)
        name = f"{prefix}model{'' if location else '-without-location'}"
        return [
            trained_monitor(
                config,
                self.made[f"{prefix}training {fold}"],
                self.folder,
                self.out / "monitors" / f"{name.replace(' ', '-')}-{fold}.npz",
                location=location,
                jobs=self.store.jobs,
                client=self.store.client,
            )
            for fold in range(len(FOLDS))
        ]

    def calibrated(self, prefix: str) -> MonitorConfig:
        """Return the fast monitor with the rules."""
        file = self.out / "monitors" / f"{prefix.replace(' ', '-')}monitor.toml"
        return calibrated_monitor(self.made[f"{prefix}calibration"], self.folder, file)

    def _tasks(self, monitors: Monitors, which: str, *, turned: bool = False) -> list[Watch]:
        located = any("from_tip" in _features(monitor) for monitor in monitors)
        return [
            Watch.of(
                entry,
                self.folder,
                monitors[fold_of(entry.spec, number) % len(monitors)],
                located=located,
                turned=turned,
            )
            for number, entry in enumerate(self.made[which])
        ]


def summarise(lab: Laboratory, episodes: int, seed: int, impossible: int) -> Summary:
    """Run all monitors and return the figures."""
    tuning_levels = lab.levels("tuning") + lab.levels("calibration")
    threshold = _tune.force_threshold(tuning_levels)
    tuning = _tune.protocol(_tune.told(lab.say("paper-tuning", [paper_monitor(threshold)], "tuning")), TUNED_ON)
    gammas = {rule: _tune.gamma(tuning, rule) for rule in _tune.RULES.values()}
    paper = [paper_monitor(threshold, rule="floored", gamma=gammas["floored"])]
    best, best_without = lab.best("", location=True), lab.best("", location=False)
    said = {name: lab.say(name, monitors, "evaluation") for name, monitors in _rules(threshold, gammas).items()}
    fast = lab.calibrated("")
    said["fast, rules"] = lab.say("fast-rules", [fast], "evaluation")
    shipped = fast.model_copy(update={"classifier": "learned"})
    said["fast, as Tactful comes"] = lab.say("fast-shipped", [shipped], "evaluation")
    main = {
        "paper": _block(lab, "paper", paper),
        "best": _block(lab, "best", best),
        "best_without_location": _block(lab, "best-without-location", best_without),
    }
    evaluation = lab.say("paper", paper, "evaluation")
    contacts = _tune.told(evaluation)
    summary: Summary = {
        "study": "kinesthetic",
        "origin": "simulation: every rate here is one of simulated contacts and assumed people",
        "onset": "the first sample with a contact force; `from_1_n` counts from the first with at least 1 N",
        "interval": "95 %: Wilson for shares, Garwood for rates",
        "version": __version__,
        "seed": seed,
        "episodes": episodes,
        "simulated": {
            which: {"episodes": len(entries), "minutes": sum(entry.duration_s for entry in entries) / 60}
            for which, entries in lab.made.items()
        },
        "impossible": impossible,
        **main,
        "tuned": {
            "threshold_n": threshold,
            "gamma": gammas,
            "operator": TUNED_BY,
            "collisions": sum(contact.kind == "collision" for contact in tuning),
            "cooperations": sum(contact.kind == "cooperation" for contact in tuning),
        },
        "protocol": {
            "paper": _score.confusion(evaluation, *EVALUATED_ON),
            "best": _score.confusion(lab.say("best", best, "evaluation"), *EVALUATED_ON),
        },
        "rules": {name: _score.short(rows) for name, rows in said.items()},
        "baselines": {
            "Fisher's discriminant": _tune.fisher(tuning, contacts),
            "level alone": _tune.level_alone(tuning, contacts),
        },
        "curves": {
            "force": _tune.force_curve(lab.levels("evaluation") + lab.levels("calibration")),
            "gamma": {rule: _tune.gamma_curve(contacts, rule) for rule in gammas},
        },
        "transitions": {
            name: _score.transitions(lab.say(name, monitors, "transitions") + lab.say(name, monitors, "evaluation"))
            for name, monitors in (("paper", paper), ("best", best))
        },
        "sensitivity": _sensitivity(lab, paper, best, threshold, gammas),
        "panda": _panda(lab, gammas["floored"]),
    }
    return summary | {"targets": targets(summary)}


def _block(lab: Laboratory, name: str, monitors: Monitors) -> Summary:
    return _score.block(lab.say(name, monitors, "evaluation"), lab.say(name, monitors, "free"))


def _rules(threshold: float, gammas: Mapping[_tune.Rule, float]) -> dict[str, list[MonitorConfig]]:
    """Return the monitors of the paper that differ in their rule alone, and the one that is printed."""
    rules = {
        f"{rule}, tuned": [paper_monitor(threshold, rule=rule, gamma=gammas[rule])] for rule in _tune.RULES.values()
    }
    return {
        "as printed": [paper_monitor(threshold, rule="literal", gamma=6.2, verbatim=True)],
        "literal, γ = 6.2": [paper_monitor(threshold, rule="literal", gamma=6.2)],
        **rules,
    }


def _sensitivity(
    lab: Laboratory, paper: Monitors, best: Monitors, threshold: float, gammas: Mapping[_tune.Rule, float]
) -> Summary:
    """Return what becomes of the figures where something differs from what was tuned and trained on."""
    angle = [paper_monitor(threshold, rule="angle", gamma=gammas["angle"])]
    found: Summary = {}
    for name, monitors in (("paper", paper), ("best", best)):
        rows = lab.say(name, monitors, "evaluation")
        repeated = {spec["seed"] for spec in (row["spec"] for row in lab.say(name, monitors, next(iter(VARIATIONS))))}
        found[name] = {
            "speed": _score.grouped(rows, "speed_m_s"),
            "approach": _score.grouped(rows, "approach"),
            "reference": _score.short([row for row in rows if row["spec"]["seed"] in repeated]),
            **{which: _score.short(lab.say(name, monitors, which)) for which in VARIATIONS},
        }
    found["turned"] = {
        name: {
            "as it is": _score.short(lab.say(name, monitors, "evaluation")),
            "turned": _score.short(lab.say(f"{name}-turned", monitors, "evaluation", turned=True)),
        }
        for name, monitors in (("floored, tuned", paper), ("angle, tuned", angle), ("best", best))
    }
    return found


def _panda(lab: Laboratory, gamma: float) -> Summary:
    """Return the figures with the noise of a real arm, with thresholds, calibration and training of its own."""
    threshold = _tune.force_threshold(lab.levels("panda calibration"))
    monitors = {
        "paper": [paper_monitor(threshold, gamma=gamma)],
        "best": lab.best("panda ", location=True),
        "best_without_location": lab.best("panda ", location=False),
    }
    figures = {
        name: _score.block(lab.say(f"panda-{name}", of, "panda evaluation"), lab.say(f"panda-{name}", of, "panda free"))
        for name, of in monitors.items()
    }
    return {"threshold_n": threshold, **figures}


def _features(monitor: MonitorConfig) -> tuple[str, ...]:
    """Return what a monitor's classifier looks at, if it was trained."""
    classifier = monitor.load_classifier()
    return classifier.model.features if isinstance(classifier, LearnedClassifier) else ()


def progress_by(total: int, first: float, progress: Callable[[float], None]) -> Callable[[], None]:
    """Return what counts tasks and tells the share that is done, from `first` on."""
    done = 0

    def one() -> None:
        nonlocal done
        done += 1
        progress(min(1.0, first + (1 - first) * done / total))

    return one
