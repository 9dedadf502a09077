"""What a client that comes late has missed: the newest events, and what latched the arm."""

from collections import deque

from pneuarm.logs.schema import pneuarm_pb2 as pb

_RECENT = 100
_LATCHED = 16  # the first is the cause; what a stuck arm tells after so many is no news
_LATCHING = (pb.FAULT, pb.ESTOP)


class EventHistory:
    """Keeps events as they are told."""

    def __init__(self) -> None:
        self._recent: deque[pb.Event] = deque(maxlen=_RECENT)
        self._latched: list[pb.Event] = []
        self._mode = 0

    def add(self, event: pb.Event) -> None:
        """Take the next event; only control's own tell the mode for certain."""
        self._recent.append(event)
        if event.source != "control":
            return
        changed, self._mode = event.mode != self._mode, event.mode
        if event.mode not in _LATCHING:
            self._latched = []
        elif (changed or event.level == pb.ERROR) and len(self._latched) < _LATCHED:
            self._latched.append(event)

    def message(self) -> pb.Events:
        """Return both."""
        return pb.Events(recent=self._recent, latched=self._latched)
