"""A measurement that is too old."""

from pneuarm.service.safety.faults import FaultCode
from pneuarm.service.safety.monitors.monitor import Observation


class Age:
    """How long ago the device was read; the age itself is the persistence.

    Used twice: an old measurement, and a device that has been silent for so long that it is lost.
    """

    def __init__(self, code: FaultCode, oldest_s: float) -> None:
        self.code = code
        self._oldest_s = oldest_s

    def look(self, seen: Observation) -> str:
        """Tell the age and what is allowed."""
        if seen.age_s <= self._oldest_s:
            return ""
        age_ms, allowed_ms = 1e3 * seen.age_s, 1e3 * self._oldest_s
        return f"the measurement is {age_ms:.0f} ms old (allowed: {allowed_ms:g} ms)"
