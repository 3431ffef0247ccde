"""The page in a real browser: it shows what the monitor tells, and what is done there reaches the arm."""

from __future__ import annotations

import json
import re
from pathlib import Path
from urllib.parse import urlsplit

import numpy as np
import pytest

from tactful import Monitor, MonitorConfig, Recording
from tactful.live import read_log
from tactful.simulation import workshop
from tests.live.view._browser import Window, served, window

pytestmark = [pytest.mark.live, pytest.mark.timeout(800, method="thread")]  # a browser may hang in a call

SPEED = 0.2
"""Of robot time: a browser without a graphics card draws a few frames a second, and the mouse has to hit the arm."""
_ROUND_S = 7.0


def stop_going_along(shown: Window) -> float:
    """Stop time while the wrist goes along +y, and return the time [s]."""
    for _ in range(10):
        shown.wait_for_time(0.5, 1.6, _ROUND_S)
        shown.click("Pause")
        shown.page.get_by_role("button", name="Go on").wait_for()
        if 0.5 < (t := shown.time_s()) % _ROUND_S < 2.2:
            return t
        shown.click("Go on")
        shown.page.get_by_role("button", name="Pause").wait_for()
    raise AssertionError("the arm does not go along +y")


def record_from_the_start(shown: Window) -> None:
    """Record a run that is younger than what the ring holds: on a machine that is too slow for the first, another."""
    while shown.time_s() > 6.0:
        shown.press("Reset")
        shown.wait_for_time(0.0, 6.0, 1e9)
    shown.press("Record")
    shown.page.get_by_role("button", name="Stop recording").wait_for()


def drag_along(shown: Window) -> None:
    """Take hold of the wrist while time stands still, and draw it further on; a hand that misses it tries again."""
    plan = workshop(np.random.default_rng(0)).plan
    mouse = shown.page.mouse
    for _ in range(6):
        wrist = plan(stop_going_along(shown)).position_m + np.array([0.0, 0.0, 0.14])
        shown.wait_for_frames()
        mouse.move(*shown.pixel(wrist))
        mouse.down()
        mouse.move(*shown.pixel(np.add(wrist, (0.0, 0.05, 0.0))), steps=2)
        mouse.move(*shown.pixel(np.add(wrist, (0.0, 0.25, 0.0))), steps=6)
        shown.click("Go on")
        try:
            shown.contact("cooperation").wait_for(timeout=30_000)
            shown.shot("live_drag")
            mouse.up()
            return
        except shown.late:
            mouse.up()
            shown.open(shown.page.url)  # the camera has turned instead of the arm
    raise AssertionError(f"no cooperation: {shown.contacts()}")


def test_touch_record_and_replay(tmp_path: Path) -> None:
    """A hand by mouse is told as cooperation, the obstacle as collision, and a recording tells both again."""
    with window(tmp_path) as shown:
        with served("--source", "sim", "--speed", str(SPEED), folder=tmp_path) as (process, address):
            shown.open(address)
            record_from_the_start(shown)
            shown.page.get_by_text(re.compile(r"s · the arm goes on")).wait_for()
            drag_along(shown)
            shown.page.get_by_text(re.compile(r"s · the arm goes on")).wait_for()
            shown.tab("Touch")
            shown.press("Put it in the way")
            shown.tab("Contacts")
            assert re.search(r"p = [01]\.\d\d", shown.choose("collision"))
            timeline = shown.page.get_by_role("img", name="timeline of contacts").inner_html()
            assert "cooperation" in timeline
            assert "collision" in timeline
            shown.shot("live_collision")
            shown.page.get_by_role("button", name="Stop recording").click()
            shown.page.get_by_role("button", name="Record").wait_for()
            assert process.poll() is None
        assert shown.errors == []
        assert {urlsplit(url.removeprefix("blob:")).hostname for url in shown.requests} == {"127.0.0.1"}

        (path,) = tmp_path.glob("tactful-*.parquet")
        log = read_log(path)
        told = {event["id"]: (event["kind"], event["onset_s"]) for event in log["events"]}
        assert {"cooperation", "collision"} <= {kind for kind, _ in told.values()}
        lines = [json.loads(line) for line in (tmp_path / "events.jsonl").read_text().splitlines()]
        assert [event["onset_s"] for event in log["events"]] == [
            line["onset_s"] for line in lines[: len(log["events"])]
        ]
        config = MonitorConfig(**log["config"])
        again = Monitor(config=config.model_copy(update={"robot": config.robot.model_copy(update={"model": "panda"})}))
        timeline = again.run(Recording.read(path))
        assert [(event.kind, event.onset_s) for event in timeline] == list(told.values())

        with served("--source", f"replay:{path}", folder=tmp_path) as (_, address):
            shown.open(address)
            lines = [json.loads(line) for line in (tmp_path / "events.jsonl").read_text().splitlines()]
            assert [(line["kind"], line["onset_s"]) for line in lines] == list(told.values())
            shown.tab("Recording")
            shown.page.get_by_role("slider").first.press("End")
            shown.tab("Contacts")
            shown.choose("cooperation")
            shown.shot("replay")
            shown.press_bar("collision")
            last = max(onset for _, onset in told.values())
            shown.tab("Recording")
            shown.page.get_by_role("slider").first.press("End")
            shown.tab("Contacts")
            shown.page.get_by_role("button", name=re.compile(rf"{last:.2f} s")).wait_for()
            assert len(shown.contacts()) == min(len(told), 6)
        assert shown.errors == []
