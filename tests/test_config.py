"""A mistake in a configuration ends in one line that names the section, the key, the value and what is allowed."""

from typing import Annotated, Any, Literal, Self

import numpy as np
import pytest
from pydantic import Field, PositiveFloat, ValidationError, model_validator

from tactful.config import Config, ConfigError
from tactful.errors import TactfulError


class InnerConfig(Config):
    cutoff_hz: PositiveFloat | tuple[PositiveFloat, ...] = 30.0
    norm: Literal["inf"] | Annotated[float, Field(ge=1)] = "inf"
    limits_n: tuple[float, float] = (0.0, 1.0)


class OuterConfig(Config):
    rate_hz: PositiveFloat = 1000.0
    inner: InnerConfig = InnerConfig()

    @model_validator(mode="after")
    def _below_nyquist(self) -> Self:
        if self.inner.cutoff_hz == 2 * self.rate_hz:
            raise ValueError("cutoff_hz is above half the rate")
        return self


class NeedyConfig(Config):
    threshold_n: float


def refusal(model: type[Config], **data: Any) -> ConfigError:
    """Return the error that the data cause, after a check that it is one line."""
    with pytest.raises(ConfigError) as caught:
        model(**data)
    assert isinstance(caught.value, TactfulError)
    assert len(str(caught.value).splitlines()) == 1
    return caught.value


def test_unknown_key_suggests_the_nearest() -> None:
    """A misspelt key that were ignored would leave a monitor at its default without a word."""
    error = refusal(InnerConfig, cutof_hz=10)
    assert (error.section, error.key) == ("inner", "cutof_hz")
    assert str(error) == "config, inner.cutof_hz: unknown key; did you mean 'cutoff_hz'?"


def test_unknown_key_without_a_near_one_lists_all() -> None:
    """Where nothing is similar, the keys that there are help more than a guess."""
    assert str(refusal(InnerConfig, zzz=1)).endswith("unknown key; the keys are cutoff_hz, norm, limits_n")


@pytest.mark.parametrize(
    ("data", "message"),
    [
        ({"inner": {"cutof_hz": 1}}, "config, inner.cutof_hz: unknown key; did you mean 'cutoff_hz'?"),
        ({"inner": {"cutoff_hz": -1}}, "config, inner.cutoff_hz: Input should be greater than 0, not -1"),
        ({"innner": {}}, "config, outer.innner: unknown key; did you mean 'inner'?"),
        ({"rate_hz": "x"}, "config, outer.rate_hz: Input should be a valid number, unable to parse string as a number"),
        ({"inner": 3}, "config, outer.inner: Input should be a valid dictionary or instance of InnerConfig, not 3"),
    ],
)
def test_nested_section_names_itself(data: dict[str, Any], message: str) -> None:
    """In a file of several sections, a key alone does not say where the mistake is."""
    assert str(refusal(OuterConfig, **data)).startswith(message)


@pytest.mark.parametrize(
    ("data", "key", "problem"),
    [
        ({"cutoff_hz": (1.0, -2.0)}, "cutoff_hz.1", "Input should be greater than 0, not -2.0"),
        ({"cutoff_hz": float("nan")}, "cutoff_hz", "Input should be a finite number, not nan"),
        ({"norm": 0.5}, "norm", "Input should be 'inf' or greater than or equal to 1, not 0.5"),
        (
            {"norm": "two"},
            "norm",
            "Input should be 'inf' or a valid number, unable to parse string as a number, not 'two'",
        ),
        ({"limits_n": (1.0,)}, "limits_n.1", "Field required"),
        ({"limits_n": 5}, "limits_n", "Input should be a valid tuple, not 5"),
    ],
)
def test_wrong_value_of_a_union_names_what_comes_nearest(data: dict[str, Any], key: str, problem: str) -> None:
    """Pydantic reports one problem for every type that a key may have; the first is often not the one that is meant."""
    error = refusal(InnerConfig, **data)
    assert (error.key, str(error)) == (key, f"config, inner.{key}: {problem}")


def test_long_value_stays_on_one_line() -> None:
    """The print of an array has line breaks, and a long list would bury the message."""
    assert np.shape(refusal(InnerConfig, limits_n=np.zeros((4, 4))).value) == (4, 4)
    assert len(str(refusal(OuterConfig, rate_hz=list(range(10_000))))) < 150


def test_rule_over_several_keys_names_the_section() -> None:
    """A rule that binds two keys has no key of its own, and the whole section is no value to print."""
    error = refusal(OuterConfig, rate_hz=10.0, inner={"cutoff_hz": 20.0})
    assert str(error) == "config, outer: cutoff_hz is above half the rate"


def test_missing_key_is_named() -> None:
    """Not every setting has a default."""
    assert str(refusal(NeedyConfig)) == "config, needy.threshold_n: Field required"


def test_validation_from_data_gives_the_same_error() -> None:
    """Results are read back through `model_validate`, not the constructor."""
    with pytest.raises(ConfigError, match=r"inner\.norm"):
        OuterConfig.model_validate({"inner": {"norm": 0}})


def test_configs_are_frozen_and_keyword_only() -> None:
    """A configuration is stored with every result: it has to be the one that was in force."""
    config = OuterConfig()
    with pytest.raises(ValidationError, match="frozen"):
        config.rate_hz = 1.0  # type: ignore[misc]
    with pytest.raises(TypeError):
        OuterConfig(1.0)  # type: ignore[call-arg]


def test_configs_survive_a_round_trip() -> None:
    """The stored configuration gives the same monitor again."""
    config = OuterConfig(rate_hz=500, inner=InnerConfig(cutoff_hz=(1, 2)))
    assert OuterConfig.model_validate(config.model_dump()) == config
    assert OuterConfig.model_validate_json(config.model_dump_json()) == config
