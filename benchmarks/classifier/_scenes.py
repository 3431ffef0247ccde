"""The scenes that the classifier is trained on, each with the settings that a user of that arm would have."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks.classifier._rooms import room
from tactful import MonitorConfig, Recording, Robot
from tactful.calibration import calibrate
from tactful.control import ImpedanceConfig
from tactful.errors import TactfulError
from tactful.simulation import KINDS, EpisodeSpec, collision_and_help, draw_plan, generate

TAUGHT_BY = ("brisk", "calm", "hesitant", "abrupt")
"""The operators of the training; the others are left to test it."""
_TOUCHED = tuple(kind for kind in KINDS if kind != "free")
_IDENTIFIED = {"velocity_rad_s": 0.001, "torque_nm": 0.05, "model_nm": 0.2}
"""Noise of an arm whose model is right."""
_STIFFER = ImpedanceConfig(stiffness_n_m=400, stiffness_nm_rad=25)
_STIFF = ImpedanceConfig(stiffness_n_m=800, stiffness_nm_rad=40)


@dataclass(frozen=True)
class Part:
    """Recordings of one arm, and the settings of their monitor.

    Attributes:
        scene: what is held out together.
        files: the recordings.
        config: the settings.
    """

    scene: str
    files: tuple[Path, ...]
    config: MonitorConfig


def parts(folder: Path) -> Iterator[Part]:
    """Yield what there is to learn from; episodes that are in the folder already are not made again."""
    drawn = draw_plan(80, seed=13, kinds=_TOUCHED)
    clean = [spec for spec in drawn if spec.operator in (None, *TAUGHT_BY)]
    yield _peg("peg", folder / "peg", clean, draw_plan(2, seed=14, kinds=("free",)))
    noisy = draw_plan(24, seed=21, sensors="panda", operators=TAUGHT_BY, kinds=_TOUCHED)
    yield _peg("noisy sensors", folder / "noisy", noisy, draw_plan(3, seed=22, sensors="panda", kinds=("free",)))
    for arm, impedance in ((1, _STIFFER), (2, _STIFF)):
        other = {"payload_error_kg": 0.1, "impedance": impedance}
        elastic = arm == 2
        touched = draw_plan(12, seed=40 + arm, operators=TAUGHT_BY, kinds=_TOUCHED, arm=arm, elastic=elastic)
        free = draw_plan(2, seed=50 + arm, kinds=("free",), arm=arm, elastic=elastic)
        plans = [[spec.model_copy(update=other) for spec in plan] for plan in (touched, free)]
        yield _peg("other arms and impedances", folder / f"arm {arm}", *plans)
    leaning = _leaning(folder / "leaning", 24)
    for noise in (_IDENTIFIED, {}):
        yield Part("leaning against a post", leaning, MonitorConfig(robot={"model": "panda"}, noise=noise))
    rooms = (
        ("straight ways", "panda", True, 30),
        ("joint motion", "panda", False, 30),
        ("other robots", "iiwa14", False, 8),
        ("other robots", "gen3", False, 8),
        ("other robots", "ur5e", False, 8),
    )
    for number, (scene, name, straight, count) in enumerate(rooms):
        files = _rooms(folder / scene / name, name, count, 210 + number, straight=straight)
        for noise in (_IDENTIFIED, {}):
            yield Part(scene, files, MonitorConfig(robot={"model": name}, noise=noise))


def _peg(scene: str, folder: Path, touched: Sequence[EpisodeSpec], free: Sequence[EpisodeSpec]) -> Part:
    """Return episodes of the peg, and what a calibration from contact-free episodes of the same arm gives."""
    quiet = [Recording.read(file) for file in _episodes(folder / "free", free)]
    files = _episodes(folder / "touched", touched)
    settings = folder / "calibrated.toml"
    if not settings.is_file():
        calibrate(quiet, MonitorConfig.load(folder / "free" / "monitor.toml")).save(settings)
    return Part(scene, files, MonitorConfig.load(settings))


def _episodes(folder: Path, plan: Sequence[EpisodeSpec]) -> tuple[Path, ...]:
    files = []
    for spec in plan:
        try:
            files.append(folder / generate([spec], folder, jobs=1)[0].file)
        except TactfulError:  # none of its attempts gives what the spec asks for
            continue
    return tuple(files)


def _leaning(folder: Path, count: int) -> tuple[Path, ...]:
    """Return episodes of an arm that a hand helps round the post against which it leans."""
    folder.mkdir(parents=True, exist_ok=True)
    files = tuple(folder / f"{number:03d}.parquet" for number in range(count))
    for number, file in enumerate(files):
        if not file.exists():
            episode = collision_and_help(np.random.default_rng((220, number)))
            for _ in episode.run():
                pass
            episode.cell.recording().save(file)
    return files


def _rooms(folder: Path, name: str, count: int, seed: int, *, straight: bool) -> tuple[Path, ...]:
    folder.mkdir(parents=True, exist_ok=True)
    robot, files = Robot.load(name), list[Path]()
    for number in range(20 * count):
        file = folder / f"{number:03d}.parquet"
        nothing = file.with_suffix(".nothing")
        if not file.exists() and not nothing.exists():
            recording = room(robot, np.random.default_rng((seed, number)), straight=straight)
            if recording is None:
                nothing.touch()
            else:
                recording.save(file)
        if file.exists():
            files.append(file)
        if len(files) == count:
            break
    return tuple(files)
