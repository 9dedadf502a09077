"""A reading that no pressure can give."""

from pneuarm.controllers.arm.arm import Arm
from pneuarm.service.safety.faults import FaultCode
from pneuarm.service.safety.monitors.monitor import Observation, Persistence, bar, chamber


class SensorRange:
    """Not a number, or far outside the chamber's range."""

    code = FaultCode.SENSOR_INVALID

    def __init__(self, arm: Arm, margin_pa: float, lasting_s: float) -> None:
        self._low_pa = float(arm.per_chamber("pressure_min_pa").min()) - margin_pa
        self._high_pa = float(arm.per_chamber("pressure_max_pa").max()) + margin_pa
        self._lasting_s = lasting_s
        self._lasting = Persistence()

    def look(self, seen: Observation) -> str:
        """Name the chamber and what its sensor says."""
        low, high = self._low_pa, self._high_pa
        bad = -1
        for index, reading in enumerate(seen.measured_pa):
            if not low <= reading <= high:  # true of a NaN
                bad = index
        if not self._lasting.longer(bad >= 0, seen.now_s, self._lasting_s):
            return ""
        return f"{chamber(bad)} reads {bar(seen.measured_pa[bad])}"
