"""A pressure that falls while it is held: a leak."""

from math import exp
from typing import Annotated

from pydantic import Field

from pneuarm.controllers.arm.arm import Arm
from pneuarm.hardware.tables.table import BAR, Positive, Table
from pneuarm.service.modes.mode import Mode
from pneuarm.service.monitors.fault import Fault, Policy
from pneuarm.service.monitors.monitor import (
    MS,
    Lasting,
    Monitor,
    Observation,
    Persistence,
    bar,
    chamber,
)

#: After the hold begins the valves need this long to close; what is then measured is the start.
SETTLED_S = 0.8
#: Time constant of the filter that keeps the sensor's noise out.
FILTER_S = 0.2


class LeakKeys(Table):
    """When a held pressure that falls is a leak."""

    lost_bar: Annotated[Positive, Field(description="how much of a held pressure may be lost")] = (
        0.03
    )
    lasting_ms: Lasting = 300.0


class Leak(Monitor):
    """While the arm holds: how much of each pressure's amount is gone since the hold settled.

    A valve that goes on regulating refills what leaks: then there is nothing to see here.
    """

    fault = Fault(
        "leak",
        7,
        Policy.RAMP,
        "a held pressure falls: a leak",
        "find the leak of the chamber that the event names (soapy water shows it), then reset",
    )
    looks_at = "what a held pressure has lost since the hold settled"
    how_to_set = (
        "above the drift of the sensors and the creep of the walls in `hold_timeout_s`. A valve "
        "that regulates refills a small leak: then it is not seen here"
    )
    keys = LeakKeys

    def __init__(self, arm: Arm, keys: LeakKeys) -> None:
        self._lost_pa, self._lasting_s = keys.lost_bar * BAR, keys.lasting_ms * MS
        self._persistence = Persistence()
        self._held_s = 0.0
        self._filtered_pa: list[float] = []
        self._start_pa: list[float] = []

    def look(self, seen: Observation) -> str:
        """Name the chamber and what it has lost."""
        if seen.mode != Mode.HOLD:
            self._held_s = 0.0
            return ""
        self._filter(seen)
        index = self._fallen()
        if not self._persistence.longer(index >= 0, seen.now_s, self._lasting_s):
            return ""
        start, now = self._start_pa[index], self._filtered_pa[index]
        return f"{chamber(index)} was held at {bar(start)} and has {bar(now)}"

    def _filter(self, seen: Observation) -> None:
        if self._held_s == 0.0:
            self._filtered_pa = self._start_pa = seen.measured_pa
        self._held_s += seen.dt_s
        rest = exp(-seen.dt_s / FILTER_S)
        self._filtered_pa = [
            now + rest * (before - now)
            for now, before in zip(seen.measured_pa, self._filtered_pa, strict=True)
        ]
        if self._held_s <= SETTLED_S:
            self._start_pa = self._filtered_pa

    def _fallen(self) -> int:
        for index, (start, now) in enumerate(zip(self._start_pa, self._filtered_pa, strict=True)):
            lost_pa = start - now if start > 0.0 else now - start
            if lost_pa > self._lost_pa and abs(start) > self._lost_pa:
                return index
        return -1
