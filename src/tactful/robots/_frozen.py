"""Immutable records that hold numpy arrays."""

from __future__ import annotations

from dataclasses import fields
from functools import partial
from types import MappingProxyType
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array: TypeAlias = NDArray[np.float64]


class FrozenRecord:
    """Makes a frozen dataclass copy and pickle through its constructor, so that its arrays stay read-only."""

    def __reduce__(self) -> tuple[Any, ...]:
        state = {f.name: getattr(self, f.name) for f in fields(self)}  # type: ignore[arg-type]
        plain = {k: dict(v) if isinstance(v, MappingProxyType) else v for k, v in state.items()}
        return partial(type(self), **plain), ()


def frozen_array(value: ArrayLike, dtype: type[np.generic] = np.float64) -> NDArray[Any]:
    """A read-only, C-contiguous copy of `value`."""
    array = np.array(value, dtype=dtype, order="C")
    array.flags.writeable = False
    return array
