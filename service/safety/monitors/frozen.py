"""A sensor that repeats itself bit by bit while its command moves."""

from pneuarm.service.safety.faults import FaultCode
from pneuarm.service.safety.monitors.monitor import Observation, Persistence, bar, chamber


class Frozen:
    """How far the expected pressure has moved since the reading last changed by even one bit.

    No time alone makes a reading frozen: a device that rounds to a millibar may well say the same
    for hours at a constant pressure, and one that is read at 50 Hz repeats itself in between.
    """

    code = FaultCode.SENSOR_FROZEN

    def __init__(self, moved_pa: float, lasting_s: float) -> None:
        self._moved_pa, self._lasting_s = moved_pa, lasting_s
        self._lasting = Persistence()
        self._reading_pa: list[float] = []
        self._expected_pa: list[float] = []

    def look(self, seen: Observation) -> str:
        """Name the chamber and the reading at which it stands."""
        if not self._reading_pa:
            self._reading_pa, self._expected_pa = list(seen.measured_pa), list(seen.expected_pa)
        frozen = -1
        pairs = zip(seen.measured_pa, seen.expected_pa, strict=True)
        for index, (reading, expected) in enumerate(pairs):
            if reading != self._reading_pa[index]:
                self._reading_pa[index], self._expected_pa[index] = reading, expected
            elif abs(expected - self._expected_pa[index]) > self._moved_pa:
                frozen = index
        if not self._lasting.longer(frozen >= 0, seen.now_s, self._lasting_s):
            return ""
        moved_pa = abs(seen.expected_pa[frozen] - self._expected_pa[frozen])
        reading_pa = self._reading_pa[frozen]
        return (
            f"{chamber(frozen)} stands at {bar(reading_pa)} while its command moved {bar(moved_pa)}"
        )
