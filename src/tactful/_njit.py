"""The compiler of the kernels, with a cache that several processes can fill.

Numba names the machine code of a function on records by a number that it gives each record type as it meets it, anew in
every process (`Record.mangling_args`). Two specializations that were cached by different processes can then have one
name, and a third process that loads both calls the wrong one: wrong results, or a crash. Here the name comes from the
type's fields. See numba issue 10486 for a collision of the same kind.
"""

from __future__ import annotations

import functools
import hashlib
from typing import Any

from numba import njit, types

__all__ = ["njit"]


@functools.cache
def _name(record: Any) -> tuple[str, tuple[str]]:
    return "Record", (hashlib.sha256(record.name.encode()).hexdigest()[:16],)


types.Record.mangling_args = property(_name)
