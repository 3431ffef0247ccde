"""What some tests need from outside the checkout: they skip without it and say why, or fail where all is required."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

SHARED_DATA = Path(__file__).resolve().parents[2] / "shared" / "data"


def missing(reason: str) -> None:
    """Skip the test with a reason; fail it where TACTFUL_REQUIRE_ALL is set."""
    if os.environ.get("TACTFUL_REQUIRE_ALL"):
        pytest.fail(f"{reason}, and TACTFUL_REQUIRE_ALL is set")
    pytest.skip(reason)


def require_shared_data() -> Path:
    """The folder of real recordings beside the checkout."""
    if not SHARED_DATA.is_dir():
        missing("the real recordings are not at ../shared/data")
    return SHARED_DATA
