"""The configuration as a file, and how it fits another rate."""

from pathlib import Path

import numpy as np
import pytest

from tactful import MonitorConfig
from tactful.config import ConfigError
from tactful.signals import BandError

TOML = """
rate_hz = 500
[robot]
model = "ur5e"
tip = "flange"
gravity_m_s2 = [0.0, -9.81, 0.0]
payload_kg = 1.2
[observer]
bandwidth_hz = [10, 10, 10, 20, 20, 20]
[frequency]
threshold_n = [1.0, 1.0, 2.0]
[kinesthetic]
rule = "angle"
"""


def test_a_file_sets_what_it_names_and_leaves_the_rest(tmp_path: Path) -> None:
    """A config of a few lines is a whole config; the arm comes mounted and loaded as it says."""
    path = tmp_path / "monitor.toml"
    path.write_text(TOML)
    config = MonitorConfig.load(path)
    assert config.frequency.threshold_n == (1.0, 1.0, 2.0)
    assert config.frequency.window == 500
    assert config.kinesthetic.rule == "angle"
    robot = config.robot.load()
    assert robot is not None
    assert (robot.name, robot.tip) == ("ur5e", "flange")
    np.testing.assert_array_equal(robot.gravity, [0, -9.81, 0])
    assert robot.mass.sum() == pytest.approx(MonitorConfig(robot={"model": "ur5e"}).robot.load().mass.sum() + 1.2)  # type: ignore[union-attr]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("rate = 100", "config, monitor.rate: unknown key; did you mean 'rate_hz'?"),
        ("[frequency]\nthresold_n = 1", "config, frequency.thresold_n: unknown key; did you mean 'threshold_n'?"),
        ("[frequency]\nthreshold_n = -1", "config, frequency"),
        ("rate_hz = 'fast'", "rate_hz: Input should be a valid number"),
        ("rate_hz = nan", "finite number"),
        ("[frequency", "is not TOML"),
    ],
)
def test_a_mistake_in_the_file_is_one_line(tmp_path: Path, text: str, message: str) -> None:
    """Typing errors are the commonest error: the message names section and key, and the nearest known key."""
    path = tmp_path / "monitor.toml"
    path.write_text(text)
    with pytest.raises(ConfigError) as error:
        MonitorConfig.load(path)
    assert message in str(error.value)
    assert "\n" not in str(error.value)


def test_a_file_that_is_not_there_or_not_text_is_one_line(tmp_path: Path) -> None:
    """The path is in the message."""
    with pytest.raises(ConfigError, match=r"nowhere\.toml: cannot be read: No such file"):
        MonitorConfig.load(tmp_path / "nowhere.toml")
    (tmp_path / "log.parquet").write_bytes(bytes(range(256)))
    with pytest.raises(ConfigError, match="is not text"):
        MonitorConfig.load(tmp_path / "log.parquet")


def test_defaults_fit_any_rate_and_what_was_set_stays() -> None:
    """At 80 Hz the default band becomes all that is there; a band that was asked for is refused instead of changed."""
    low = MonitorConfig().fitted_to(80.0).frequency
    assert (low.window, low.band_hz) == (40, (2.0, 40.0))
    assert MonitorConfig().fitted_to(1020.0) == MonitorConfig()
    fast = MonitorConfig().fitted_to(4000.0).frequency
    assert (fast.window, fast.band_hz) == (2000, (10.0, 100.0))
    asked = MonitorConfig(frequency={"band_hz": (10, 100)}).fitted_to(80.0)
    from tactful import Monitor

    with pytest.raises(BandError, match=r"carries at most 0\.16-40 Hz"):
        Monitor(config=asked)
