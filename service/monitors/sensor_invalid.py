"""A reading that no working sensor gives."""

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


class SensorInvalidKeys(Table):
    """When a reading is nonsense."""

    margin_bar: Annotated[
        Positive,
        Field(
            description=(
                "a reading this far outside the arm's pressures, or not a number, is a broken "
                "sensor"
            )
        ),
    ] = 1.0
    lasting_ms: Lasting = 50.0


class SensorInvalid(Monitor):
    """Not a number, or far outside the chamber's range."""

    fault = Fault(
        "sensor_invalid",
        3,
        Policy.RAMP,
        "a pressure sensor reads nonsense: a broken wire or a dead sensor",
        "look at the sensor of the chamber that the event names, then reset",
    )
    looks_at = "NaN, or far outside the arm's pressures"
    how_to_set = "above what a working sensor may read beside the arm's pressures"
    keys = SensorInvalidKeys

    def __init__(self, arm: Arm, keys: SensorInvalidKeys) -> None:
        margin_pa = keys.margin_bar * BAR
        self._low_pa = float(arm.per_chamber("pressure_min_pa").min()) - margin_pa
        self._high_pa = float(arm.per_chamber("pressure_max_pa").max()) + margin_pa
        self._lasting_s = keys.lasting_ms * MS
        self._persistence = Persistence()

    def look(self, seen: Observation) -> str:
        """Name the chamber and what its sensor says."""
        low, high = self._low_pa, self._high_pa
        bad = -1
        for index, reading in enumerate(seen.measured_pa):
            if not low <= reading <= high:  # true of a NaN
                bad = index
        if not self._persistence.longer(bad >= 0, seen.now_s, self._lasting_s):
            return ""
        return f"{chamber(bad)} reads {bar(seen.measured_pa[bad])}"
