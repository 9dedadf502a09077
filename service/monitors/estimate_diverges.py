"""An estimate that has left what the arm can be."""

from typing import Annotated

from pydantic import Field

from pneuarm.controllers.arm.arm import Arm
from pneuarm.hardware.tables.table import MM, Positive, Table
from pneuarm.service.monitors.fault import Fault, Policy
from pneuarm.service.monitors.monitor import (
    MS,
    Lasting,
    Monitor,
    Observation,
    Persistence,
    chamber,
)


class EstimateDivergesKeys(Table):
    """When an estimated length is impossible."""

    margin_mm: Annotated[
        Positive,
        Field(description="how far an estimated length may be outside Eq. (4)'s interval"),
    ] = 30.0
    lasting_ms: Lasting = 100.0


class EstimateDiverges(Monitor):
    """Estimated lengths outside Eq. (4)'s interval by a margin, or no numbers at all."""

    fault = Fault(
        "estimate_diverges",
        10,
        Policy.HOLD,
        "the estimated lengths are impossible: a sensor or its calibration",
        "compare the state's lengths with the arm, then enable again",
    )
    looks_at = "estimated lengths outside Eq. (4)'s interval"
    how_to_set = "above the error of an estimate, at the ends of the interval too"
    keys = EstimateDivergesKeys

    def __init__(self, arm: Arm, keys: EstimateDivergesKeys) -> None:
        margin_m = keys.margin_mm * MM
        self._low_m = (arm.per_chamber("length_min_m").ravel() - margin_m).tolist()
        self._high_m = (arm.per_chamber("length_max_m").ravel() + margin_m).tolist()
        self._lasting_s = keys.lasting_ms * MS
        self._persistence = Persistence()

    def look(self, seen: Observation) -> str:
        """Name the chamber and its estimated length."""
        bad = -1
        bounds = zip(seen.estimated_m, self._low_m, self._high_m, strict=True)
        for index, (length, low, high) in enumerate(bounds):
            if not low <= length <= high:  # true of a NaN
                bad = index
        if not self._persistence.longer(bad >= 0, seen.now_s, self._lasting_s):
            return ""
        low_mm, high_mm = 1e3 * self._low_m[bad], 1e3 * self._high_m[bad]
        length_mm = 1e3 * seen.estimated_m[bad]
        return (
            f"{chamber(bad)} is estimated at {length_mm:.0f} mm; {low_mm:.0f} to {high_mm:.0f} mm "
            "are possible"
        )
