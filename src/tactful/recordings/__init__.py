"""Recordings: what a robot's sensors said, from whatever file, in canonical channels, SI units and radians."""

from tactful.recordings._channels import CHANNELS, Channel
from tactful.recordings._errors import RecordingError
from tactful.recordings._label import Label
from tactful.recordings._quality import Quality
from tactful.recordings._recording import Recording
from tactful.recordings._summary import Summary, summarize

__all__ = ["CHANNELS", "Channel", "Label", "Quality", "Recording", "RecordingError", "Summary", "summarize"]
