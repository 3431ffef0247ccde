"""One file a format; each is found by name.

A format module offers `matches(head)`, which looks at the first bytes of a file, and `open_table(path)`, which gives
its columns. One that can also write offers `SUFFIX` and `save(recording, path)`, which writes the file it is given.
Adding a format is adding a file here.
"""

from __future__ import annotations

from collections.abc import Iterator
from importlib import import_module
from pkgutil import iter_modules
from types import ModuleType


def modules() -> Iterator[ModuleType]:
    """The format modules; plain text, which anything may be, comes last."""
    names = sorted((module.name for module in iter_modules(__path__)), key=lambda name: (name == "csv", name))
    for name in names:
        yield import_module(f"{__name__}.{name}")
