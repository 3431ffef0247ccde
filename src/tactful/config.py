"""The base of every configuration: frozen, keyword-only, validated where it is built, no unknown key."""

from __future__ import annotations

import difflib
import reprlib
import tomllib
from pathlib import Path
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import BaseModel, ConfigDict, ValidationError

from tactful.errors import TactfulError


class ConfigError(TactfulError):
    """A configuration that cannot be: `section` and `key` say where, `value` what stood there."""

    def __init__(self, section: str, key: str, problem: str, value: object = None) -> None:
        self.section, self.key, self.value = section, key, value
        super().__init__(f"config, {section}{'.' + key if key else ''}: {problem}")


class Config(BaseModel):
    """A frozen pydantic model that turns every mistake into one `ConfigError`."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False, validate_default=True)

    def __init__(self, **data: Any) -> None:
        """Validate the keys and their values.

        Raises:
            ConfigError: for an unknown key (it suggests the nearest one) or a value that is not allowed.
        """
        try:
            super().__init__(**data)
        except ValidationError as error:
            raise _one_line(type(self), error) from None

    @classmethod
    def from_toml(cls, path: str | Path) -> Self:
        """Return the configuration that a TOML file holds; what it does not name has its default.

        Raises:
            ConfigError: if the file cannot be read, is not TOML, or has an unknown key or a value that is not allowed.
        """
        file = Path(path)
        try:
            data: dict[str, Any] = tomllib.loads(file.read_text(encoding="utf-8"))
        except OSError as error:
            raise ConfigError(str(file), "", f"cannot be read: {error.strerror}") from None
        except UnicodeDecodeError:
            raise ConfigError(str(file), "", "is not text: a configuration is a TOML file in UTF-8") from None
        except tomllib.TOMLDecodeError as error:
            raise ConfigError(str(file), "", f"is not TOML: {error}") from None
        return cls(**data)


def _one_line(model: type[Config], error: ValidationError) -> ConfigError:
    """Put the problem that lies deepest into one line: where a key may hold several types, that one is the closest."""

    def key_of(loc: tuple[int | str, ...]) -> str:
        return ".".join(str(part) for part in loc if not isinstance(part, str) or part in model.model_fields)

    problems = error.errors()
    section = model.__name__.removesuffix("Config").lower()
    deepest = max(problems, key=lambda problem: len(problem["loc"]))
    if deepest["type"] == "extra_forbidden":
        key = str(deepest["loc"][0])
        near = difflib.get_close_matches(key, model.model_fields, n=1)
        known = f"did you mean {near[0]!r}?" if near else f"the keys are {', '.join(model.model_fields)}"
        return ConfigError(section, key, f"unknown key; {known}")
    key, value = key_of(deepest["loc"]), deepest["input"]
    here = [problem for problem in problems if key_of(problem["loc"]) == key]
    nearest = [problem for problem in here if not problem["type"].endswith("_type")] or here
    message = " or ".join(dict.fromkeys(problem["msg"] for problem in nearest))
    message = message.removeprefix("Value error, ").replace(" or Input should be", " or")
    if not key or deepest["type"] == "missing":  # the value is the whole section
        return ConfigError(section, key, message)
    return ConfigError(section, key, f"{message}, not {' '.join(reprlib.repr(value).split())}", value)


def per_joint(section: str, key: str, value: ArrayLike, n: int) -> NDArray[np.float64]:
    """Return one number of a setting for each of n joints (n,), read-only.

    Raises:
        ConfigError: if there are neither one nor n numbers.
    """
    numbers = np.atleast_1d(np.asarray(value, dtype=np.float64))
    if len(numbers) not in (1, n):
        problem = f"has {len(numbers)} numbers; give one, or one for each of the {n} joints"
        raise ConfigError(section, key, problem, value)
    return np.broadcast_to(numbers, (n,))
