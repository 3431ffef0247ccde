"""Errors cross the borders of processes: a worker's has to reach its caller whole."""

import pickle

import pytest

from tactful.config import ConfigError
from tactful.errors import TactfulError
from tactful.robots import UnknownRobotError
from tactful.signals import BandError


@pytest.mark.parametrize(
    "error",
    [
        TactfulError("log.csv: torn"),
        ConfigError("frequency", "window", "is too short", 1),
        BandError((10.0, 100.0), 80.0, 40),
        UnknownRobotError("pandaa", ("panda",)),
    ],
    ids=lambda error: type(error).__name__,
)
def test_an_error_survives_pickling_with_its_fields(error: TactfulError) -> None:
    """Python rebuilds an exception from its message, which the children do not take."""
    again = pickle.loads(pickle.dumps(error))
    assert type(again) is type(error)
    assert str(again) == str(error)
    assert vars(again) == vars(error)
