"""A pressure that does not follow its command: a stuck valve, a kinked or burst tube."""

from pneuarm.service.safety.faults import FaultCode
from pneuarm.service.safety.monitors.monitor import Observation, Persistence, bar, chamber

#: By how much the true lag may differ from the configured one, as a fraction. In a fast move it
#: errs by this fraction of what the valve has still to go.
LAG_UNCERTAINTY = 0.5


class PressureFollows:
    """Compares with the first-order prediction; what the valve may lag is allowed for.

    A vented chamber has longer: how fast it empties is a matter of its tubes, not of its valve.
    """

    code = FaultCode.PRESSURE_DEVIATES

    def __init__(self, tolerance_pa: float, lasting_s: float, vent_timeout_s: float) -> None:
        self._tolerance_pa = tolerance_pa
        self._lasting_s, self._vent_timeout_s = lasting_s, vent_timeout_s
        self._lasting = Persistence()
        self._active = False

    def look(self, seen: Observation) -> str:
        """Name the chamber, what it measures and what was expected."""
        index = self._deviating(seen)
        in_fault = self._active or not seen.vented
        needed_s = self._lasting_s if in_fault else self._vent_timeout_s
        self._active = self._lasting.longer(index >= 0, seen.now_s, needed_s)
        if not self._active:
            return ""
        measured, expected = seen.measured_pa[index], seen.expected_pa[index]
        return f"{chamber(index)} has {bar(measured)}; {bar(expected)} was expected"

    def _deviating(self, seen: Observation) -> int:
        tolerance_pa = self._tolerance_pa
        triples = zip(seen.measured_pa, seen.expected_pa, seen.sent_pa, strict=True)
        for index, (measured, expected, sent) in enumerate(triples):
            to_go_pa = abs(sent - expected)
            if abs(measured - expected) > tolerance_pa + LAG_UNCERTAINTY * to_go_pa:
                return index
        return -1
