"""What `import tactful` costs, and that the public names lead to their packages."""

import importlib
import subprocess
import sys

import pytest

import tactful

EXTRAS = {"cyclopts", "rich", "matplotlib", "mujoco", "pinocchio", "pyarrow", "sklearn"}


def modules_after(code: str) -> set[str]:
    """Return the top-level modules that a fresh interpreter holds after running `code`."""
    report = f"{code}\nimport sys\nprint(*{{name.partition('.')[0] for name in sys.modules}})"
    run = subprocess.run([sys.executable, "-c", report], capture_output=True, text=True, check=True)
    return set(run.stdout.split())


def test_import_is_light() -> None:
    """A program that imports Tactful pays for what it uses only: neither numba nor numpy before the first name."""
    assert not modules_after("import tactful") & {*EXTRAS, "numba", "numpy", "pydantic", "scipy"}


def test_library_runs_without_extras() -> None:
    """An arm's controller need not install plotting, simulation or the command line's packages to monitor."""
    assert not modules_after("from tactful import *") & EXTRAS


@pytest.mark.parametrize("name", tactful.__all__)
def test_public_name_is_that_of_its_package(name: str) -> None:
    """A lazy name that is misspelt, or gone from its package, would fail only when a user first touches it."""
    home = importlib.import_module(tactful._HOME.get(name, "tactful.errors"))
    assert getattr(tactful, name) is getattr(home, name)


def test_lazy_table_is_complete() -> None:
    """`__all__` and the table of lazy names are two lists of one thing."""
    assert {*tactful._HOME, "TactfulError"} == set(tactful.__all__) <= set(dir(tactful))


def test_unknown_name_is_an_attribute_error() -> None:
    """`hasattr` and `from tactful import` rely on AttributeError from a module's `__getattr__`."""
    with pytest.raises(AttributeError, match="no attribute 'Robo'"):
        _ = tactful.Robo  # type: ignore[attr-defined]
