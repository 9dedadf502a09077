"""A chamber that is near bursting."""

from pneuarm.controllers.arm.arm import Arm
from pneuarm.service.safety.faults import FaultCode
from pneuarm.service.safety.monitors.monitor import Observation, Persistence, bar, chamber


class Overpressure:
    """A measured pressure above its chamber's limit by a margin."""

    code = FaultCode.OVERPRESSURE

    def __init__(self, arm: Arm, margin_pa: float, lasting_s: float) -> None:
        highest = arm.per_chamber("pressure_max_pa").reshape(-1)
        self._allowed_pa = (highest + margin_pa).tolist()
        self._lasting_s = lasting_s
        self._lasting = Persistence()

    def look(self, seen: Observation) -> str:
        """Name the chamber and its pressure."""
        over = -1
        pairs = zip(seen.measured_pa, self._allowed_pa, strict=True)
        for index, (reading, allowed) in enumerate(pairs):
            if reading > allowed:
                over = index
        if not self._lasting.longer(over >= 0, seen.now_s, self._lasting_s):
            return ""
        allowed = self._allowed_pa[over]
        return f"{chamber(over)} has {bar(seen.measured_pa[over])}, above {bar(allowed)}"
