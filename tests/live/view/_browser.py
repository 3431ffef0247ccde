"""The page of a command that runs in a process of its own, in a real browser without a screen."""

from __future__ import annotations

import importlib.util
import os
import re
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from tactful.live.view._scene import CAMERA_FOV_RAD, CAMERA_M, LOOK_AT_M
from tests._counterparts import missing

_FLAGS = [
    "--no-sandbox",
    "--disable-gpu",
    "--use-gl=angle",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
]
_REMARK = "Unable to preventDefault inside passive event listener"
"""What Chromium remarks on the mouse over viser's own canvas; nothing is wrong then."""
_START_S, _WAIT_MS = 300.0, 120_000
SHOTS = os.environ.get("TACTFUL_SHOTS")


@contextmanager
def served(*arguments: str, folder: Path) -> Iterator[tuple[subprocess.Popen[str], str]]:
    """Run `tactful live ... --view`, and yield the process and the address of its page; Ctrl-C ends it."""
    with_us = ["setpriv", "--pdeathsig", "KILL"]  # whatever ends the tests, the command ends, too
    command = [*with_us, sys.executable, "-m", "tactful", "live", *arguments, "--view", "--port", "0", "--json"]
    told = folder / "stderr"
    with told.open("w") as errors, (folder / "events.jsonl").open("w") as events:
        process = subprocess.Popen(command, cwd=folder, stdout=events, stderr=errors, text=True)
        try:
            yield process, _address(process, told)
        finally:
            process.send_signal(signal.SIGINT)
            try:
                process.wait(60)
            except subprocess.TimeoutExpired:
                process.kill()


def _address(process: subprocess.Popen[str], told: Path) -> str:
    until = time.monotonic() + _START_S
    while time.monotonic() < until and process.poll() is None:
        said = told.read_text()
        if "Ctrl-C" in said and (found := re.search(r"http://127\.0\.0\.1:\d+", said)):  # it runs
            return found.group()
        time.sleep(0.1)
    raise AssertionError(f"no page: {told.read_text()}")


class Window:
    """A browser's window with the page.

    Attributes:
        page: the page, as Playwright has it.
        late: what Playwright raises when something does not come.
        errors: what the console said that is an error, and exceptions.
        requests: what the page asked for.
    """

    def __init__(self, page: Any, late: type[Exception]) -> None:
        self.page, self.late = page, late
        self.errors: list[str] = []
        self.requests: list[str] = []
        page.set_default_timeout(_WAIT_MS)
        page.on("console", self._note)
        page.on("pageerror", lambda error: self.errors.append(str(error)))
        page.on("request", lambda request: self.requests.append(request.url))
        page.on("websocket", lambda socket: self.requests.append(socket.url))

    def _note(self, said: Any) -> None:
        if said.type == "error" and not said.text.startswith(_REMARK):
            self.errors.append(said.text)

    def open(self, address: str) -> None:
        """Load the page and wait until it shows a state."""
        self.page.goto(address)
        self.page.locator("[data-tactful=state]").wait_for()

    def state(self) -> str:
        """Return the state that the page shows."""
        return str(self.page.locator("[data-tactful=state]").inner_text())

    def tab(self, name: str) -> None:
        """Show a tab."""
        self.page.get_by_role("tab", name=name).click()

    def press(self, name: str) -> None:
        """Press a button."""
        self.page.get_by_role("button", name=name, exact=True).click()

    def contact(self, kind: str) -> Any:
        """Return the newest contact of a kind in the list, which may still have to come."""
        return self.page.get_by_role("button", name=re.compile(rf"\d s +· +{kind}")).first

    def choose(self, kind: str) -> str:
        """Choose the newest contact of a kind, and return its evidence; while the list moves on, try again."""
        evidence = self.page.locator("[data-tactful=evidence]").filter(has_text=f"{kind}: ")
        for _ in range(3):
            self.contact(kind).click()
            try:
                evidence.wait_for(timeout=_WAIT_MS / 4)
            except self.late:
                continue
            return str(evidence.inner_text())
        raise AssertionError(f"the evidence of a {kind} is not shown: {self.contacts()}")

    def press_bar(self, kind: str) -> None:
        """Press a contact of a kind in the strip of time, and wait for its evidence."""
        strip = self.page.get_by_role("img", name="timeline of contacts")
        strip.locator("rect").filter(has_text=kind).last.click()
        self.page.locator("[data-tactful=evidence]").filter(has_text=f"{kind}: ").wait_for()

    def contacts(self) -> list[str]:
        """Return what the list says, newest first."""
        buttons = self.page.get_by_role("button", name=re.compile(r"\d s +· +"))
        return [" ".join(text.split()) for text in buttons.all_inner_texts()]

    def pixel(self, point_m: ArrayLike) -> tuple[float, float]:
        """Return where a point (3,) [m] is seen, from the camera with which the page begins."""
        box = self.page.locator("canvas").first.bounding_box()
        ahead = np.subtract(LOOK_AT_M, CAMERA_M)
        ahead = ahead / np.linalg.norm(ahead)
        right = np.cross(ahead, [0.0, 0.0, 1.0])
        right /= np.linalg.norm(right)
        away = np.subtract(point_m, CAMERA_M)
        scale = box["height"] / 2 / np.tan(CAMERA_FOV_RAD / 2) / (away @ ahead)
        x = box["x"] + box["width"] / 2 + scale * (away @ right)
        return float(x), float(box["y"] + box["height"] / 2 - scale * (away @ np.cross(right, ahead)))

    def time_s(self) -> float:
        """Return the robot's time that the page shows [s]."""
        said = self.page.locator("[data-tactful=details]").inner_text()
        found = re.match(r"([\d.]+) s", said)
        return float(found.group(1)) if found else -1.0

    def click(self, name: str) -> None:
        """Click a button while the mouse is elsewhere."""
        self.page.get_by_role("button", name=name, exact=True).first.dispatch_event("click")

    def wait_for_time(self, low_s: float, high_s: float, period_s: float) -> float:
        """Wait until the robot's time is between two of a period, and return it [s]."""
        self.page.wait_for_function(
            """([low, high, period]) => {
                const told = document.querySelector('[data-tactful=details]').innerText.match(/^([\\d.]+) s/);
                return told && low < told[1] % period && told[1] % period < high;
            }""",
            arg=[low_s, high_s, period_s],
        )
        return self.time_s()

    def wait_for_frames(self, count: int = 3) -> None:
        """Wait until so many more pictures are drawn."""
        self.page.evaluate(
            """async count => {
                for (let k = 0; k < count; k++) await new Promise(drawn => requestAnimationFrame(drawn));
            }""",
            count,
        )

    def shot(self, name: str) -> None:
        """Keep a picture where TACTFUL_SHOTS names a folder."""
        if SHOTS:
            self.page.evaluate("document.querySelectorAll('[class*=Notification-root]').forEach(e => e.remove())")
            self.wait_for_frames()
            self.page.screenshot(path=Path(SHOTS) / f"{name}.png")


@contextmanager
def window(folder: Path) -> Iterator[Window]:
    """Open a window of 1280 x 800; fewer pixels keep a processor that has to draw them all from doing nothing else."""
    chromium = shutil.which("chromium")
    if chromium is None:
        missing("chromium is not installed")
    if importlib.util.find_spec("playwright") is None:
        missing("playwright is not installed")
    from playwright.sync_api import TimeoutError, sync_playwright

    with sync_playwright() as playwright:
        context = playwright.chromium.launch_persistent_context(
            folder / "profile",
            executable_path=chromium,
            headless=True,
            args=_FLAGS,
            viewport={"width": 1280, "height": 800},
            device_scale_factor=1.0 if SHOTS else 0.4,
        )
        try:
            yield Window(context.pages[0], TimeoutError)
        finally:
            context.close()
