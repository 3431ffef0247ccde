"""What holds for every test: under TACTFUL_REQUIRE_ALL=1, as in CI, none may be skipped."""

import os
from collections.abc import Generator
from pathlib import Path
from typing import TypeVar

import pytest

Report = TypeVar("Report", pytest.TestReport, pytest.CollectReport)

REQUIRE_ALL = bool(os.environ.get("TACTFUL_REQUIRE_ALL"))


def pytest_configure() -> None:
    """Drop compiled kernels older than any source: numba looks at a kernel's own file, not at what it calls."""
    package = Path(__file__).parents[1] / "src" / "tactful"
    newest = max(source.stat().st_mtime for source in package.rglob("*.py"))
    for index in package.rglob("*.nbi"):
        if index.stat().st_mtime < newest:
            index.unlink(missing_ok=True)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport() -> Generator[None, pytest.TestReport, pytest.TestReport]:
    """Turn a test that skips into one that fails."""
    report = yield
    return _refuse_skip(report)


@pytest.hookimpl(wrapper=True)
def pytest_make_collect_report() -> Generator[None, pytest.CollectReport, pytest.CollectReport]:
    """Turn a module that skips itself into an error."""
    report = yield
    return _refuse_skip(report)


def _refuse_skip(report: Report) -> Report:
    if REQUIRE_ALL and report.skipped and not hasattr(report, "wasxfail"):
        reason = report.longrepr[2] if isinstance(report.longrepr, tuple) else report.longrepr
        report.outcome = "failed"
        report.longrepr = f"{reason} (TACTFUL_REQUIRE_ALL is set: nothing may be skipped)"
    return report
