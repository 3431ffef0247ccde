"""The verbs `train` and `tune`, on files."""

import io
import shutil
from contextlib import redirect_stdout
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tactful import Label, MonitorConfig, Recording, Robot
from tactful.classification import LearnedClassifier
from tactful.cli._app import main
from tests.monitor._touched import Touch, recording

SETTINGS = '[robot]\nmodel = "panda"\n[noise]\nvelocity_rad_s = 0.0005\ntorque_nm = 0.05\nmodel_nm = 0.1\n'


@pytest.fixture(autouse=True)
def _wide(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "200")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """24 recordings with one contact each: sudden forces against the motion, slow ones across it, by two operators."""
    path = tmp_path_factory.mktemp("set")
    (path / "settings.toml").write_text(SETTINGS)
    panda, rng = Robot.load("panda"), np.random.default_rng(0)
    for number in range(24):
        hit = number % 2 == 0
        size = rng.uniform(10, 20)
        aside = np.append(rng.standard_normal(1), rng.standard_normal(1))
        aside /= np.linalg.norm(aside)
        force = (0.0, -size, 0.0) if hit else (size * aside[0], 0.0, size * aside[1])
        touch = Touch(1.2, 1.7, force, rise_s=0.01 if hit else 0.1)
        made = recording(panda, touch, duration_s=1.9, noise_nm=0.02, seed=number)
        label = Label("collision" if hit else "cooperation", 1.2, 1.7)
        note = f"operator: {'ab'[number // 2 % 2]}"
        replace(made, labels=(label,), notes=(note,)).save(path / f"{number:02d}.npz")
    return path


@pytest.fixture(scope="module")
def trained(folder: Path) -> tuple[Path, str]:
    """What `train` makes of them, and what it says."""
    target, said = folder / "model.npz.trained", io.StringIO()
    words = ["train", str(folder), "--config", str(folder / "settings.toml"), "-o", str(target), "--without-location"]
    with redirect_stdout(said):
        assert main(words) == 0
    return target, " ".join(said.getvalue().split())


def test_from_recordings_to_a_monitor_that_uses_the_model(
    folder: Path, trained: tuple[Path, str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The way of a user: train, tune on what is at hand, monitor with the result, which explains itself."""
    shutil.copy(trained[0], tmp_path / "model.npz")
    tuned = tmp_path / "tuned.toml"
    words = [
        "tune",
        str(folder),
        "--config",
        str(folder / "settings.toml"),
        "--classifier",
        str(tmp_path / "model.npz"),
    ]
    assert main([*words, "-o", str(tuned), "--max-misclassified-collisions", "0.3"]) == 0
    said = capsys.readouterr().out
    assert "at most 30 % of collisions like these are taken for cooperation, with a confidence of 95 % (0 of 12" in said
    assert isinstance(MonitorConfig.load(tuned).load_classifier(), LearnedClassifier)
    assert main(["evaluate", str(folder), "--config", str(tuned)]) == 0
    said = capsys.readouterr().out
    assert "12 of 12" in said
    assert main(["monitor", str(folder / "01.npz"), "--config", str(tuned)]) == 0
    assert "probability of cooperation" in " ".join(capsys.readouterr().out.split())


def test_what_train_says(trained: tuple[Path, str]) -> None:
    """How good it is on operators that it has not seen, with intervals."""
    path, said = trained
    assert "trained on 12 collisions and 12 cooperations; held out by operator" in said
    for name in ("accuracy", "specificity", "sensitivity", "spurious cooperation", "operator a", "operator b"):
        assert f"{name} " in said
    assert not LearnedClassifier(path).model.with_location


def test_where_the_bound_cannot_be_kept_nothing_is_written(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Twelve collisions cannot support 5 %: the verb says how many more it takes, and ends with 1."""
    target = tmp_path / "tuned.toml"
    assert main(["tune", str(folder), "--config", str(folder / "settings.toml"), "-o", str(target)]) == 1
    assert "47 more collisions are needed" in capsys.readouterr().out
    assert not target.exists()


def test_bad_input_is_one_line(folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """No folder, no arm, no labels, no model, a wrong share: each in one line, with what to do."""
    settings, target = str(folder / "settings.toml"), ["-o", str(tmp_path / "out")]

    def refused(*words: str) -> str:
        assert main(list(words)) == 2
        out, err = capsys.readouterr()
        assert out == ""
        assert err.count("\n") == 1
        return err

    for verb in ("train", "tune"):
        assert "there is no folder" in refused(verb, str(folder), "-o", str(tmp_path / "no" / "out"))
        assert "which arm was recorded?" in refused(verb, str(folder), *target)
        assert "holds no recording" in refused(verb, str(tmp_path), "--config", settings, *target)
    assert "it has to lie between 0 and 1" in refused(
        "tune", str(folder), *target, "--max-misclassified-collisions", "5", "--config", settings
    )
    words = ("tune", str(folder), *target, "--config", settings, "--classifier")
    assert "there is no file 'gone.npz'" in refused(*words, "gone.npz")
    assert "is no classifier" in refused(*words, str(folder / "00.npz"))
    one = tmp_path / "one"
    one.mkdir()
    shutil.copy(folder / "00.npz", one)
    assert "have no cooperation that the monitor detected" in refused("train", str(one), *target, "--config", settings)
    Recording(t=np.arange(300) / 100, channels={"wrench": np.zeros((300, 6))}).save(one / "wrench.npz")
    assert "have no cooperation" in refused("train", str(one), *target, "--config", settings)
