"""What the user can do, by mouse or keyboard: start, pause, record, touch, choose reactions and thresholds."""

from __future__ import annotations

import html
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from tactful.live.view._messages import Array, Frame, Setup
from tactful.live.view._words import calibration, small
from tactful.monitor import MonitorConfig
from tactful.reaction import NAMED

if TYPE_CHECKING:
    import viser

Ask = Callable[..., None]
"""Called with the name of a wish and what it needs."""


class Controls:
    """Buttons and fields of the tabs `Touch` and `Settings`, and those above them.

    Args:
        server: the page.
        setup: what is watched.
        ask: how to ask the loop for something.
    """

    def __init__(self, server: viser.ViserServer, setup: Setup, ask: Ask) -> None:
        self._gui, self._setup, self._ask = server.gui, setup, ask
        self._paused = self._recording = False
        self._base = setup.config
        self._poses: Callable[[int], Array] | None = None

    def run(self) -> None:
        """Add what starts, pauses and records."""
        self._group = self._gui.add_button_group("Run", self._offers(), hint="Reset begins a new run")

        @self._group.on_click
        def _(event: viser.GuiEvent) -> None:
            wishes = {
                "Pause": ("pause", True),
                "Go on": ("pause", False),
                "Reset": ("restart",),
                "Record": ("record", True),
                "Stop recording": ("record", False),
            }
            self._ask(*wishes[self._group.value])

        self._notice = self._gui.add_html("", visible=False)

    def _offers(self) -> tuple[str, ...]:
        record = "Stop recording" if self._recording else "Record"
        return ("Go on" if self._paused else "Pause", "Reset", record) if self._setup.workshop else (record,)

    def touch(self, held: Callable[[int], Array]) -> None:
        """Add the hand and the obstacle; `held` says where a link is (3,) [m]."""
        gui, setup, ask = self._gui, self._setup, self._ask
        if setup.robot is None or setup.obstacle_m is None:
            return
        gui.add_html(small("Drag any link with the mouse: a spring pulls it, as a hand would. Or by keyboard:"))
        with gui.add_folder("Hand"):
            links = setup.robot.link_names
            link = gui.add_dropdown("Link", links, initial_value=links[-1])
            pull = gui.add_vector3("Pull x y z [m]", (0.0, 0.0, 0.0), min=(-0.4,) * 3, max=(0.4,) * 3, step=0.01)
            gui.add_button("Let go", icon="hand-stop").on_click(lambda _: release())

            def release() -> None:
                pull.value = (0.0, 0.0, 0.0)
                ask("let_go")

            @pull.on_update
            def _(event: viser.GuiEvent) -> None:
                if event.client is None:
                    return
                offset = np.array(pull.value)
                if not offset.any():
                    ask("let_go")
                    return
                number = links.index(link.value)
                here = held(number)
                ask("grab", number, here, here + offset)

        with gui.add_folder("Obstacle"):
            gui.add_button("Put it in the way", icon="barrier-block").on_click(lambda _: ask("put", setup.in_the_way_m))
            gui.add_button("Put it aside", icon="arrow-right").on_click(lambda _: ask("put", setup.obstacle_m))
            x, y, z = (round(float(value), 2) for value in setup.obstacle_m)
            place = gui.add_vector3("At x y z [m]", (x, y, z), min=(-0.8, -0.9, 0.0), max=(1.1, 0.9, 1.0), step=0.01)

            @place.on_update
            def _(event: viser.GuiEvent) -> None:
                if event.client is not None:
                    ask("put", np.array(place.value))

    def settings(self) -> None:
        """Add reactions and thresholds."""
        gui, setup, ask = self._gui, self._setup, self._ask
        if setup.commanded:
            with gui.add_folder("Reaction"):
                names = tuple(NAMED)
                start = setup.policy if setup.policy in names else "continue"
                react = gui.add_dropdown("When touched", names, initial_value=start)
                react.on_update(lambda event: ask("react", react.value) if event.client is not None else None)
                gui.add_button("Go on", icon="player-play", hint="Take up the motion after a stop").on_click(
                    lambda _: ask("resume")
                )
                self._keep = gui.add_button(
                    "Keep this correction",
                    icon="route",
                    color="green",
                    disabled=True,
                    hint="Go the way that the hand has led from now on",
                )
                self._keep.on_click(lambda _: ask("keep"))
                gui.add_html(small("With <b>teach</b>, a hand that helps may lead the arm; its way can then be kept."))
        with gui.add_folder("Thresholds"):
            self._slider = gui.add_slider("Factor", min=0.3, max=3.0, step=0.05, initial_value=1.0)
            self._rate = gui.add_html(small(calibration(self._base, 1.0)))

            @self._slider.on_update
            def _(event: viser.GuiEvent) -> None:
                factor = float(self._slider.value)
                self._rate.content = small(calibration(self._base, factor))
                if event.client is not None:
                    ask("retune", scaled(self._base, factor))

    def update(self, frame: Frame) -> None:
        """Show what is so now."""
        self._recording, self._paused = frame.recording is not None, frame.paused
        if self._group.options != self._offers():
            self._group.options = self._offers()
        self._slider.disabled = self._recording
        self._notice.visible = frame.notice is not None
        if frame.notice is not None:
            self._notice.content = small(html.escape(frame.notice))
        if self._setup.commanded:
            self._keep.disabled = not (frame.taught and self._setup.workshop)


def scaled(config: MonitorConfig, factor: float) -> MonitorConfig:
    """Return a configuration with thresholds `factor` times as high."""

    def times(value: Any) -> Any:
        return tuple(factor * x for x in value) if isinstance(value, tuple) else factor * value

    fast = config.fast.model_copy(update={"threshold": times(config.fast.threshold)})
    frequency = config.frequency.model_copy(update={"threshold_n": times(config.frequency.threshold_n)})
    return config.model_copy(update={"fast": fast, "frequency": frequency})
