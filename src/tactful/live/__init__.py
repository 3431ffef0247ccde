"""The monitor on a running arm: sources of samples, the loop, reactions, and a recorder that survives a crash."""

from tactful.live._feed import Batch, Feed, Subscription
from tactful.live._recorder import Recorder, read_log
from tactful.live._session import Report, Session, Step
from tactful.live._source import ConnectionLostError, Sample, Source, SourceError, Traffic
from tactful.live.sources import open_source

__all__ = [
    "Batch",
    "ConnectionLostError",
    "Feed",
    "Recorder",
    "Report",
    "Sample",
    "Session",
    "Source",
    "SourceError",
    "Step",
    "Subscription",
    "Traffic",
    "open_source",
    "read_log",
]
