"""A pressure that falls while it is held: a leak."""

from math import exp

from pneuarm.service.modes.mode import Mode
from pneuarm.service.safety.faults import FaultCode
from pneuarm.service.safety.monitors.monitor import Observation, Persistence, bar, chamber

#: After the hold begins the valves need this long to close; what is then measured is the start.
SETTLED_S = 0.8
#: Time constant of the filter that keeps the sensor's noise out.
FILTER_S = 0.2


class Leak:
    """While the arm holds: how much of each pressure's amount is gone since the hold settled.

    A valve that goes on regulating refills what leaks: then there is nothing to see here.
    """

    code = FaultCode.LEAK

    def __init__(self, drop_pa: float, lasting_s: float) -> None:
        self._drop_pa, self._lasting_s = drop_pa, lasting_s
        self._lasting = Persistence()
        self._held_s = 0.0
        self._filtered_pa: list[float] = []
        self._start_pa: list[float] = []

    def look(self, seen: Observation) -> str:
        """Name the chamber and what it has lost."""
        if seen.mode != Mode.HOLD:
            self._held_s = 0.0
            self._lasting.longer(False, seen.now_s, 0.0)
            return ""
        self._filter(seen)
        index = self._fallen() if self._held_s > SETTLED_S else -1
        if not self._lasting.longer(index >= 0, seen.now_s, self._lasting_s):
            return ""
        start, now = self._start_pa[index], self._filtered_pa[index]
        return f"{chamber(index)} was held at {bar(start)} and has {bar(now)}"

    def _filter(self, seen: Observation) -> None:
        if self._held_s == 0.0:
            self._filtered_pa = list(seen.measured_pa)
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
            if lost_pa > self._drop_pa and abs(start) > self._drop_pa:
                return index
        return -1
