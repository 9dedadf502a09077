"""A loop that misses its deadlines."""

from pneuarm.service.safety.faults import FaultCode
from pneuarm.service.safety.monitors.monitor import Observation

WINDOW_S = 1.0


class Overruns:
    """The fraction of deadlines missed in the last whole second."""

    code = FaultCode.LOOP_OVERRUNS

    def __init__(self, allowed_fraction: float) -> None:
        self._allowed_fraction = allowed_fraction
        self._begin_s: float | None = None
        self._begin_overruns = self._ticks = 0
        self._what = ""

    def look(self, seen: Observation) -> str:
        """Tell how many deadlines were missed; it stays said for the second that follows."""
        if self._begin_s is None:
            self._begin_s, self._begin_overruns = seen.now_s, seen.overruns
        self._ticks += 1
        if seen.now_s - self._begin_s >= WINDOW_S:
            missed = seen.overruns - self._begin_overruns
            due = missed + self._ticks
            too_many = missed > self._allowed_fraction * due
            self._what = f"{missed} of {due} deadlines were missed in a second" if too_many else ""
            self._begin_s, self._begin_overruns, self._ticks = seen.now_s, seen.overruns, 0
        return self._what
