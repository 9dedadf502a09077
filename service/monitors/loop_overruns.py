"""A loop that misses its deadlines."""

from typing import Annotated

from pydantic import Field

from pneuarm.controllers.arm.arm import Arm
from pneuarm.hardware.tables.table import Table
from pneuarm.service.monitors.fault import Fault, Policy
from pneuarm.service.monitors.monitor import PERCENT, Monitor, Observation

WINDOW_S = 1.0


class LoopOverrunsKeys(Table):
    """When the loop is late too often."""

    missed_percent: Annotated[
        float,
        Field(gt=0, le=100, description="how many deadlines the loop may miss in a second"),
    ] = 5.0


class LoopOverruns(Monitor):
    """The fraction of deadlines missed in the last whole second."""

    fault = Fault(
        "loop_overruns",
        11,
        Policy.WARN,
        "the loop misses deadlines: the machine is too busy or the rate too high",
        "run `pneuarm doctor`; end other programs, or lower control.rate_hz",
    )
    looks_at = "deadlines missed in a second"
    how_to_set = "above what the machine misses while the arm does as it should"
    keys = LoopOverrunsKeys
    needs_fresh = False

    def __init__(self, arm: Arm, keys: LoopOverrunsKeys) -> None:
        self._allowed_fraction = PERCENT * keys.missed_percent
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
