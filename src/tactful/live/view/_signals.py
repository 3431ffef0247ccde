"""The plots: level against its threshold, force and external torque, over the last seconds."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from tactful.live.view._history import History, norm
from tactful.live.view._messages import Setup, Trace
from tactful.live.view._words import COLOURS

if TYPE_CHECKING:
    import viser

SPAN_S = 10.0
_JOINTS = ("#2166c4", "#e8850c", "#12925a", "#d92d20", "#8a3ab9", "#8c6239", "#d6409f", "#5c7080", "#b5a100")
_AXES = ("#d92d20", "#12925a", "#2166c4")
_STATES = (("collision", 1.0), ("cooperation", 2.0), ("contact", 3.0))
_HEIGHT = 172
_LOWEST = 0.1
"""Lowest level that is drawn: their axis is logarithmic, so that noise, threshold and blow can be seen at once."""


class Signals:
    """Three plots in a panel at the left.

    Args:
        server: the page.
        setup: what is watched.
    """

    def __init__(self, server: viser.ViserServer, setup: Setup) -> None:
        self._fast = setup.config.mode == "fast"
        n = setup.robot.n if setup.robot else 0
        self.panel = server.gui.add_panel()
        self._empty = [np.array([-SPAN_S, 0.0])]
        with self.panel.add_tab(f"Signals of the last {SPAN_S:.0f} s"):
            gui = server.gui
            levels = ["level"] if self._fast else ["x", "y", "z"]
            colours = ["#1d2a35"] if self._fast else list(_AXES)
            bands = [self._band(kind) for kind, _ in _STATES]
            named = [self._line(name, colour) for name, colour in zip(levels, colours, strict=True)]
            title = "Level of contact, over its threshold" if self._fast else "Force in the band, over its threshold"
            limit = self._line("threshold", "#d92d20", dash=(6, 4))
            self._level = self._plot(gui, title, [*bands, *named, limit], y={"distr": 3})  # logarithmic
            force = [self._line(name, colour, 1.0) for name, colour in zip("xyz", _AXES, strict=True)]
            self._force = self._plot(gui, "Force at the tip [N]", [*force, self._line("|F|", "#1d2a35", 2.0)])
            torque = [self._line(str(i + 1), _JOINTS[i % len(_JOINTS)], 1.2) for i in range(n)]
            self._torque = self._plot(gui, "External torque of the joints [Nm]", torque) if n else None

    def draw(self, history: History, end_s: float, *, ahead_s: float = 0.0) -> None:
        """Draw what came before a time [s], and a little of what came after."""
        trace = history.window(end_s - SPAN_S + ahead_s, end_s + ahead_s)
        if trace is None or len(trace.t) < 2:
            return
        t = trace.t
        ones = np.ones(len(t))
        states = [np.where(trace.state == code, 1.0, 0.0) for _, code in _STATES]
        levels = np.maximum(trace.level, _LOWEST).T[: 1 if self._fast else 3]
        self._level.data = (t, *states, *levels, ones)
        self._force.data = (t, *trace.force_n.T, norm(trace.force_n))
        if self._torque is not None:
            self._torque.data = (t, *_columns(trace))

    @staticmethod
    def _line(name: str, colour: str, width: float = 1.6, dash: tuple[int, int] | None = None) -> Any:
        line: dict[str, Any] = {"label": name, "stroke": colour, "width": width, "points": {"show": False}}
        return line | ({"dash": dash} if dash else {})

    @staticmethod
    def _band(kind: str) -> Any:
        return {
            "label": kind,
            "stroke": "transparent",
            "width": 0,
            "fill": f"{COLOURS[kind]}40",
            "scale": "state",
            "points": {"show": False, "stroke": COLOURS[kind]},  # of the legend's mark
        }

    def _plot(self, gui: viser.GuiApi, title: str, lines: list[Any], *, y: dict[str, Any] | None = None) -> Any:
        grid = {"stroke": "#e8ecf0", "width": 1}
        ticks = {"stroke": "#e8ecf0", "size": 4}
        axis = {"grid": grid, "ticks": ticks, "stroke": "#7b8a97", "font": "10px sans-serif"}
        t = self._empty[0]
        return gui.add_uplot(
            (t, *(np.full_like(t, _LOWEST) for _ in lines)),
            ({"label": "t [s]"}, *lines),
            title=title,
            height=_HEIGHT,
            scales={"x": {"time": False}, "y": y or {}, "state": {"auto": False, "range": (0.0, 1.0)}},
            axes=({**axis, "size": 26}, {**axis, "size": 38}),
            legend={"show": True, "live": False},
            cursor={"drag": {"x": False, "y": False}},
            padding=(8, 10, 0, 0),
        )


def _columns(trace: Trace) -> list[Any]:
    return [np.ascontiguousarray(column) for column in trace.tau_ext.T]
