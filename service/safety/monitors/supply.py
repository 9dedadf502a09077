"""A supply that cannot fill the arm."""

from pneuarm.service.safety.faults import FaultCode
from pneuarm.service.safety.monitors.monitor import Observation, Persistence, bar


class Supply:
    """The supply must be above every chamber's highest pressure; a device may not measure it."""

    code = FaultCode.SUPPLY_LOW

    def __init__(self, least_pa: float, lasting_s: float) -> None:
        self._least_pa, self._lasting_s = least_pa, lasting_s
        self._lasting = Persistence()

    def look(self, seen: Observation) -> str:
        """Tell what there is and what is needed; NaN, a device without such a sensor, is well."""
        low = seen.supply_pa < self._least_pa
        if not self._lasting.longer(low, seen.now_s, self._lasting_s):
            return ""
        return f"the supply has {bar(seen.supply_pa)}; at least {bar(self._least_pa)} are needed"
