"""The learned classifier and its file."""

import json
import pickle
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tactful import MonitorConfig
from tactful.classification import (
    AdditiveModel,
    KinestheticClassifier,
    KinestheticConfig,
    LearnedClassifier,
    LearnedConfig,
    ModelError,
)
from tactful.config import ConfigError
from tests.classification._onsets import at_tip, moving, touched

FEATURES = ("against_motion", "abrupt", "since_collision")


def model(**fields: Any) -> AdditiveModel:
    """Return a model that looks at the direction, less at the rise, and in a collision at the time since it began."""
    values = np.zeros((2, 3, 3))
    values[:, 0] = [-4, 0, 4]
    values[:, 1] = [-1, 0, 1]
    values[1, 2] = [-5, 0, 5]
    known: dict[str, Any] = {
        "features": FEATURES,
        "knots": np.array([[-1.0, 0.0, 1.0], [0.0, 2 / 3, 1.0], [-2.0, -1.0, 0.0]]),
        "values": values,
        "offset": np.array([0.0, -1.0]),
        "provenance": {"robot": "panda"},
        "figures": {"accuracy": 1.0},
    }
    return AdditiveModel(**(known | fields))


def test_log_odds_are_the_sum_of_the_curves() -> None:
    """By hand, with a value between knots, one beyond them, and one that is not known."""
    parts = model().contributions(np.array([0.5, 7.0, np.nan]), 0)
    np.testing.assert_allclose(parts, [2, 1, 0])
    assert model().probability(np.array([0.5, 7.0, np.nan]), 0) == pytest.approx(1 / (1 + np.exp(-3)))
    assert model().probability(np.array([0.0, 2 / 3, 3.0]), 1) == pytest.approx(1 / (1 + np.exp(-4)))


def test_it_tells_with_the_evidence_that_decided() -> None:
    """The probability is the confidence, and the features that counted are told in words, the strongest first."""
    onset = touched(at_tip([0, -10, 0]), moving([0, 0.2, 0]))
    verdict = LearnedClassifier(model()).classify(onset)
    assert verdict.kind == "collision"
    assert verdict.confidence == pytest.approx(1 / (1 + np.exp(-4)), abs=0.01)
    assert [evidence.rule for evidence in verdict.evidence] == ["probability", "against_motion"]
    assert verdict.evidence[1].text == (
        "the force at the tip is -1.00 along its motion (-1 against, 1 with it): 4.0 for collision"
    )
    assert LearnedClassifier(model()).classify(touched(at_tip([0, 10, 0]), moving([0, 0.2, 0]))).kind == "cooperation"


def test_it_waits_until_it_is_sure_or_asked_last() -> None:
    """A force across the motion is not clear: contact, as long as it may wait, but no longer."""
    y, dq = at_tip([10, -1, 0]), moving([0, 0.2, 0])
    first = touched(y, dq)
    assert first.detected_s is not None
    now = float(first.t[-1])
    learned = LearnedClassifier(model())
    waits = learned.classify(touched(y, dq, next_s=now + 0.02))
    assert (waits.kind, waits.evidence[0].rule) == ("contact", "probability")
    assert learned.classify(touched(y, dq, next_s=now + 0.06)).kind == "collision"
    assert learned.classify(first).kind == "collision"
    assert LearnedClassifier(model(), LearnedConfig(threshold=0.3)).classify(first).kind == "cooperation"
    sure = learned.classify(touched(at_tip([0, -10, 0]), dq, next_s=now + 0.02))
    assert sure.kind == "collision"


@pytest.mark.parametrize("p", [0.02, 0.4, 0.6, 0.96, 0.999])
def test_a_higher_threshold_never_makes_cooperation_of_a_collision(p: float) -> None:
    """Tuning relies on it, whether the classifier may wait or not."""
    for last in (True, False):
        kinds = [LearnedConfig(threshold=float(t)).kind(p, last=last) for t in np.linspace(0.05, 0.995, 100)]
        helped = [kind == "cooperation" for kind in kinds]
        assert helped == sorted(helped, reverse=True)


def test_what_a_model_cannot_tell_the_rules_do() -> None:
    """In paper mode, or where only a wrench is known, a contact must not stay unclassified."""
    onset = touched(at_tip([0, -10, 0]), moving([0, 0.2, 0]), torque_change_nm=None)
    for rules in (KinestheticClassifier(), KinestheticClassifier(KinestheticConfig(rule="angle"))):
        verdict, expected = LearnedClassifier(model(), otherwise=rules).classify(onset), rules.classify(onset)
        assert (verdict.kind, verdict.confidence) == (expected.kind, expected.confidence)


def test_the_built_in_model_is_read_and_looks_nowhere_in_particular() -> None:
    """It is a file of the package, and must not lean on where people touch the arm of a simulation."""
    built_in = LearnedClassifier().model
    assert not built_in.with_location
    assert len(built_in.figures["scenes"]) >= 4
    assert built_in.provenance["made_by"].endswith("python -m benchmarks.classifier")


@pytest.mark.parametrize("scale", [0.0, 1e-6, 1e3])
def test_the_built_in_model_tells_any_contact(scale: float) -> None:
    """However weak, strong, slow or fast: when it is asked last it tells a kind, with the probability of that kind."""
    onset = touched(scale * at_tip([3, -10, 5]), scale * moving([0.01, 0.2, 0]))
    classifier = LearnedClassifier()
    verdict = classifier.classify(onset)
    threshold = classifier.model.threshold
    least = {"cooperation": threshold, "collision": 1 - threshold}[verdict.kind]
    assert least <= verdict.confidence <= 1


def test_a_model_reads_back_as_it_was(tmp_path: Path) -> None:
    """Bit for bit, with where it comes from."""
    path = tmp_path / "model.npz"
    model().save(path)
    again = AdditiveModel.load(path)
    assert again.features == FEATURES
    for name in ("knots", "values", "offset"):
        np.testing.assert_array_equal(getattr(again, name), getattr(model(), name))
    assert again.provenance == {"robot": "panda"}
    assert again.figures == {"accuracy": 1.0}
    assert not again.with_location
    with np.load(path, allow_pickle=False) as archive:
        assert {archive[name].dtype.kind for name in archive.files} == {"U", "f"}


def _write(path: Path, change: Any = None, **arrays: Any) -> None:
    model().save(path)
    with np.load(path) as archive:
        content: dict[str, Any] = {name: archive[name] for name in archive.files}
    if change is not None:
        about = json.loads(str(content["about"])) | change
        content["about"] = np.array(json.dumps(about))
    content |= arrays
    np.savez(path, **{name: value for name, value in content.items() if value is not None})


@pytest.mark.parametrize(
    ("change", "arrays", "line"),
    [
        ({"format": "something"}, {}, "is no classifier: train one with `tactful train`"),
        ({"version": 1}, {}, "has version 1, but 2 is needed: train it anew"),
        ({"threshold": 1.5}, {}, "is damaged: its threshold is no probability"),
        ({"features": ["against_motion", "abrupt", "since_colision"]}, {}, "does not know; is it 'since_collision'?"),
        ({"features": "abrupt"}, {}, "is damaged: it does not say what it looks at"),
        ({"contexts": ["first"]}, {}, "is damaged: it does not say what it looks at"),
        (None, {"about": None}, "is no classifier"),
        (None, {"about": np.array("[]")}, "is no classifier"),
        (None, {"knots": None}, "is damaged: knots is missing or holds no numbers"),
        (None, {"offset": np.array(["a", "b"])}, "is damaged: offset is missing or holds no numbers"),
        (None, {"knots": np.zeros((3, 3))}, "is damaged: its knots do not ascend"),
        (None, {"values": np.zeros((2, 3, 4))}, "is damaged: its arrays do not fit each other"),
        (None, {"offset": np.array([0.0, np.nan])}, "is damaged: its arrays do not fit each other"),
        (None, {"knots": np.float64(1.0)}, "is damaged: its arrays do not fit each other"),
    ],
)
def test_a_foreign_or_damaged_file_is_refused_in_one_line(change: Any, arrays: Any, line: str, tmp_path: Path) -> None:
    """Each way in which a file can be wrong is told, with its path."""
    path = tmp_path / "model.npz"
    _write(path, change, **arrays)
    with pytest.raises(ModelError) as caught:
        AdditiveModel.load(path)
    assert line in str(caught.value)
    assert str(caught.value).startswith(f"{path}: ")
    assert "\n" not in str(caught.value)
    assert str(pickle.loads(pickle.dumps(caught.value))) == str(caught.value)


def test_nothing_in_a_file_is_executed(tmp_path: Path) -> None:
    """A pickle is refused, alone and within an archive; so is what is no archive, or a torn one."""
    path = tmp_path / "model.npz"
    path.write_bytes(pickle.dumps({"about": 1}))
    with pytest.raises(ModelError, match="is no classifier, or damaged"):
        AdditiveModel.load(path)
    np.savez(path, about=np.array([{}], dtype=object), allow_pickle=True)
    with pytest.raises(ModelError, match="is no classifier, or damaged"):
        AdditiveModel.load(path)
    model().save(path)
    for content in (b"", b"hello", path.read_bytes()[:300]):
        path.write_bytes(content)
        with pytest.raises(ModelError):
            AdditiveModel.load(path)
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("about.npy", "junk")
    with pytest.raises(ModelError):
        AdditiveModel.load(path)
    with pytest.raises(ModelError, match="cannot be read: No such file"):
        AdditiveModel.load(tmp_path / "gone.npz")
    with pytest.raises(ModelError, match="cannot be written: No such file"):
        model().save(tmp_path / "no" / "model.npz")


def test_the_configuration_names_it(tmp_path: Path) -> None:
    """`classifier` is a path relative to the file that names it, so that a folder can be moved."""
    model().save(tmp_path / "model.npz")
    (tmp_path / "monitor.toml").write_text('classifier = "model.npz"\n[learned]\nthreshold = 0.7\n')
    learned = MonitorConfig.load(tmp_path / "monitor.toml").load_classifier()
    assert isinstance(learned, LearnedClassifier)
    assert learned.config.threshold == 0.7
    with pytest.raises(ConfigError, match=r"monitor\.classifier: there is no file 'kinestetic'"):
        MonitorConfig(classifier="kinestetic").load_classifier()
