"""The look of all pictures."""

from __future__ import annotations

from typing import Any

from tactful.errors import TactfulError

STYLE: Any = {
    "font.size": 9,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.color": "#e6e8eb",
    "grid.linewidth": 0.6,
    "axes.axisbelow": True,
    "axes.edgecolor": "#9aa0a6",
    "xtick.color": "#5f6368",
    "ytick.color": "#5f6368",
    "svg.fonttype": "none",
    "svg.hashsalt": "tactful",
}
"""What matplotlib is told."""

KIND_COLOURS = {
    "contact": "#8a8f98",
    "collision": "#d1495b",
    "cooperation": "#3a9d6e",
    "expected_impact": "#2e74b5",
    "unexpected_impact": "#b5489d",
}
"""Of the kinds of a contact."""


def matplotlib() -> Any:
    """Return the module.

    Raises:
        TactfulError: if it is not installed.
    """
    try:
        import matplotlib
        import matplotlib.figure
    except ImportError:
        raise TactfulError('pictures need matplotlib: pip install "tactful[plot]"') from None
    return matplotlib
