"""The folder of the study, in which the planar sweep and the bench stand beside each other."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from tactful.errors import TactfulError
from tactful.studies.aim_aware._page import page
from tactful.studies.aim_aware._tables import tables

Figures = dict[str, Any]


def earlier(out: Path) -> Figures:
    """Return what an earlier study wrote into the folder; nothing if there is nothing.

    Raises:
        TactfulError: if there is a summary.json that is none.
    """
    file = out / "summary.json"
    if not file.is_file():
        return {}
    try:
        summary: Any = json.loads(file.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise TactfulError(f"{file} cannot be read: {error}; choose another folder") from None
    return summary if isinstance(summary, dict) else {}


def write(out: Path, summary: Figures) -> None:
    """Write `summary.json`, `tables.md` and `report.html`, with the figures that lie in the folder."""
    (out / "summary.json").write_text(json.dumps(summary, indent=1, allow_nan=False) + "\n", encoding="utf-8")
    (out / "tables.md").write_text(tables(summary), encoding="utf-8")
    (out / "report.html").write_text(page(summary, out), encoding="utf-8")
