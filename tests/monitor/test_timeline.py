"""What comes out: lines, files, pictures."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest

from tactful import Monitor, MonitorConfig, Recording, Timeline
from tactful.classification import Evidence
from tactful.errors import TactfulError


@pytest.fixture(scope="module")
def timeline() -> Timeline:
    """One contact in a wrench, told by its frequency content."""
    t = np.arange(3000) / 1000
    wrench = np.zeros((3000, 6))
    wrench[1500:2000, 1] = 12.0
    rec = Recording(t=t, channels={"wrench": wrench}, source="a/touch.csv", format="made")
    return Monitor(config=MonitorConfig(mode="paper")).run(rec, trace=True)


def test_json_lines_have_the_fields_and_only_json_values(timeline: Timeline) -> None:
    """Any JSON reader takes them: no NaN, tuples as lists."""
    (line,) = timeline.to_json_lines().splitlines()
    event = json.loads(line, parse_constant=lambda name: pytest.fail(f"{name} is not JSON"))
    assert event["kind"] == "contact"
    assert event["directions"] == ["y"]
    assert event["evidence"][0]["value"] is None
    assert event["peak_force_n"] == pytest.approx(12)


def test_parquet_holds_the_events_and_the_configuration(timeline: Timeline, tmp_path: Path) -> None:
    """A result without its settings cannot be explained later."""
    path = tmp_path / "events.parquet"
    timeline.save(path)
    table = pq.read_table(path)
    assert table.to_pylist()[0]["onset_s"] == timeline.events[0].onset_s
    stored = json.loads(table.schema.metadata[b"tactful"])
    assert stored["config"]["frequency"]["threshold_n"] == 0.85
    assert list(tmp_path.iterdir()) == [path]


def test_no_contact_saves_an_empty_table_of_the_same_columns(timeline: Timeline, tmp_path: Path) -> None:
    """Whoever joins the tables of many recordings needs no special case."""
    quiet = Monitor().run(
        Recording(t=np.arange(2000) / 1000, channels={"wrench": np.zeros((2000, 6))}, source="q", format="made")
    )
    for name, result in (("full", timeline), ("empty", quiet)):
        result.save(tmp_path / f"{name}.parquet")
    assert pq.read_schema(tmp_path / "full.parquet").equals(pq.read_schema(tmp_path / "empty.parquet"))


@pytest.mark.parametrize("name", ["events.csv", "events", "nowhere/events.jsonl", "nowhere/events.parquet"])
def test_a_place_where_it_cannot_be_saved_is_one_line(timeline: Timeline, tmp_path: Path, name: str) -> None:
    """Nothing is left half written."""
    with pytest.raises(TactfulError, match="events"):
        timeline.save(tmp_path / name)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("suffix", [".png", ".svg", ".pdf"])
def test_the_picture_shows_forces_levels_threshold_and_the_contact(
    timeline: Timeline, tmp_path: Path, suffix: str
) -> None:
    """Three curves of force, three of level, the threshold, and a band named after the kind."""
    path = tmp_path / f"picture{suffix}"
    figure = timeline.plot(path)
    assert path.stat().st_size > 5000
    strip, force, level = figure.axes
    assert len(force.lines) == 4  # three axes and the moment of detection
    assert len(level.lines) == 5
    assert "contact\n12 N" in [text.get_text() for text in strip.texts]


def test_the_picture_of_the_fast_detector_shows_its_statistic() -> None:
    """One curve against one threshold: the statistic has no axes."""
    rng = np.random.default_rng(0)
    rec = Recording(
        t=np.arange(2000) / 1000, channels={"wrench": 0.05 * rng.normal(size=(2000, 6))}, source="q", format="made"
    )
    _, _, level = Monitor().run(rec, trace=True).plot().axes
    assert level.get_ylabel() == "statistic / threshold"
    assert len(level.lines) == 2


def test_a_picture_needs_a_trace_and_a_format(timeline: Timeline, tmp_path: Path) -> None:
    """Both mistakes are said in one line."""
    bare = Monitor().run(
        Recording(t=np.arange(2000) / 1000, channels={"wrench": np.zeros((2000, 6))}, source="q", format="made")
    )
    with pytest.raises(TactfulError, match="trace=True"):
        bare.plot()
    with pytest.raises(TactfulError, match="not supported"):
        timeline.plot(tmp_path / "picture.xyz")


def test_what_decided_is_the_verdict_not_what_explains_it(timeline: Timeline) -> None:
    """People read one line: the last evidence with a threshold, not the feature that is listed after it."""
    verdict = Evidence("probability", 0.9, 0.5, "cooperation: probability of cooperation 0.900 > 0.5")
    feature = Evidence("power", 0.4, None, "power 0.4: 1.2 for cooperation")
    event = replace(timeline.events[0], evidence=(verdict, feature))
    assert event.decision == verdict.text
    assert replace(event, evidence=(feature,)).decision == feature.text
    assert replace(event, evidence=()).decision == ""
