"""A setpoint on the device that is not ours."""

from pneuarm.service.safety.faults import FaultCode
from pneuarm.service.safety.monitors.monitor import Observation, Persistence, bar, chamber


class Setpoint:
    """What the device says it was told must lie between our last command and its lagged value.

    The lagged value allows for the time that the setpoint takes to the device and back.
    """

    code = FaultCode.SETPOINT_FOREIGN

    def __init__(self, tolerance_pa: float, lasting_s: float) -> None:
        self._tolerance_pa, self._lasting_s = tolerance_pa, lasting_s
        self._lasting = Persistence()

    def look(self, seen: Observation) -> str:
        """Name the chamber, its setpoint and ours; without setpoints there is nothing to see."""
        setpoints_pa = seen.setpoints_pa or []
        foreign = self._foreign(setpoints_pa, seen)
        if not self._lasting.longer(foreign >= 0, seen.now_s, self._lasting_s):
            return ""
        theirs, ours = setpoints_pa[foreign], seen.sent_pa[foreign]
        return f"{chamber(foreign)} is set to {bar(theirs)} on the device; we sent {bar(ours)}"

    def _foreign(self, setpoints_pa: list[float], seen: Observation) -> int:
        for index, setpoint in enumerate(setpoints_pa):
            sent, expected = seen.sent_pa[index], seen.expected_pa[index]
            above = setpoint - max(sent, expected)
            below = min(sent, expected) - setpoint
            if max(above, below) > self._tolerance_pa:  # false of a NaN: not told
                return index
        return -1
