"""A chamber that is near bursting."""

from typing import Annotated

from pydantic import Field

from pneuarm.controllers.arm.arm import Arm
from pneuarm.hardware.tables.table import BAR, Positive, Table
from pneuarm.service.monitors.fault import Fault, Policy
from pneuarm.service.monitors.monitor import (
    MS,
    Lasting,
    Monitor,
    Observation,
    Persistence,
    bar,
    chamber,
)


class OverpressureKeys(Table):
    """When a chamber has too much pressure."""

    margin_bar: Annotated[
        Positive,
        Field(
            description="how far a measured pressure may be above its chamber's `pressure_max_bar`"
        ),
    ] = 0.15
    lasting_ms: Lasting = 20.0


class Overpressure(Monitor):
    """A measured pressure above its chamber's limit by a margin."""

    fault = Fault(
        "overpressure",
        5,
        Policy.VENT,
        "a chamber is above its highest pressure and may burst: its valve or its calibration",
        "look at the valve of the chamber that the event names, and at the chamber, then reset",
    )
    looks_at = "measured pressure above the chamber's limit"
    how_to_set = "below what the chamber stands"
    keys = OverpressureKeys

    def __init__(self, arm: Arm, keys: OverpressureKeys) -> None:
        highest = arm.per_chamber("pressure_max_pa").ravel()
        self._allowed_pa = (highest + keys.margin_bar * BAR).tolist()
        self._lasting_s = keys.lasting_ms * MS
        self._persistence = Persistence()

    def look(self, seen: Observation) -> str:
        """Name the chamber and its pressure."""
        over = -1
        pairs = zip(seen.measured_pa, self._allowed_pa, strict=True)
        for index, (reading, allowed) in enumerate(pairs):
            if reading > allowed:
                over = index
        if not self._persistence.longer(over >= 0, seen.now_s, self._lasting_s):
            return ""
        allowed = self._allowed_pa[over]
        return f"{chamber(over)} has {bar(seen.measured_pa[over])}, above {bar(allowed)}"
