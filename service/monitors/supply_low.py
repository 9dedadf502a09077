"""A supply that cannot fill the arm."""

from typing import Annotated

from pydantic import Field

from pneuarm.controllers.arm.arm import Arm
from pneuarm.hardware.tables.table import BAR, Table
from pneuarm.service.monitors.fault import Fault, Policy
from pneuarm.service.monitors.monitor import MS, Lasting, Monitor, Observation, Persistence, bar


class SupplyLowKeys(Table):
    """When the supply is too low."""

    margin_bar: Annotated[
        float,
        Field(
            ge=0,
            le=10,
            description="how far the supply must be above the highest `pressure_max_bar`",
        ),
    ] = 0.2
    lasting_ms: Annotated[Lasting, Field(description="for how long it may be below")] = 500.0


class SupplyLow(Monitor):
    """The supply must be above every chamber's highest pressure; a device may not measure it."""

    fault = Fault(
        "supply_low",
        8,
        Policy.HOLD,
        "the supply pressure is too low: the compressor or its regulator",
        "restore the supply, then enable again",
    )
    looks_at = "the supply, where the device measures it"
    how_to_set = "`margin_bar` is what the valves need above the highest chamber pressure"
    keys = SupplyLowKeys

    def __init__(self, arm: Arm, keys: SupplyLowKeys) -> None:
        highest_pa = float(arm.per_chamber("pressure_max_pa").max())
        self._least_pa = highest_pa + keys.margin_bar * BAR
        self._lasting_s = keys.lasting_ms * MS
        self._persistence = Persistence()

    def look(self, seen: Observation) -> str:
        """Tell what there is and what is needed; NaN, a device without such a sensor, is well."""
        low = seen.supply_pa < self._least_pa
        if not self._persistence.longer(low, seen.now_s, self._lasting_s):
            return ""
        return f"the supply has {bar(seen.supply_pa)}; at least {bar(self._least_pa)} are needed"
