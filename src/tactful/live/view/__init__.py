"""The page of a running monitor, in a browser. Needs the extra `view`."""

from tactful.live.view._replay import replay, settings_of
from tactful.live.view._view import View
from tactful.live.view._workshop import CONFIG, WorkshopSource

__all__ = ["CONFIG", "View", "WorkshopSource", "replay", "settings_of"]
