"""The page of a running monitor, in a browser. Needs the extra `view`."""

from tactful.live.view._replay import replay
from tactful.live.view._view import View

__all__ = ["View", "replay"]
