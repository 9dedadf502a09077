"""An estimate that has left what the arm can be."""

from pneuarm.controllers.arm.arm import Arm
from pneuarm.service.safety.faults import FaultCode
from pneuarm.service.safety.monitors.monitor import Observation, Persistence, chamber


class Estimate:
    """Estimated lengths outside Eq. (4)'s interval by a margin, or no numbers at all."""

    code = FaultCode.ESTIMATE_DIVERGES

    def __init__(self, arm: Arm, margin_m: float, lasting_s: float) -> None:
        self._low_m = (arm.per_chamber("length_min_m").reshape(-1) - margin_m).tolist()
        self._high_m = (arm.per_chamber("length_max_m").reshape(-1) + margin_m).tolist()
        self._lasting_s = lasting_s
        self._lasting = Persistence()

    def look(self, seen: Observation) -> str:
        """Name the chamber and its estimated length."""
        bad = -1
        bounds = zip(seen.estimated_m, self._low_m, self._high_m, strict=True)
        for index, (length, low, high) in enumerate(bounds):
            if not low <= length <= high:  # true of a NaN
                bad = index
        if not self._lasting.longer(bad >= 0, seen.now_s, self._lasting_s):
            return ""
        low_mm, high_mm = 1e3 * self._low_m[bad], 1e3 * self._high_m[bad]
        length_mm = 1e3 * seen.estimated_m[bad]
        return (
            f"{chamber(bad)} is estimated at {length_mm:.0f} mm; {low_mm:.0f} to {high_mm:.0f} mm "
            "are possible"
        )
