"""A setpoint on the device that is not ours."""

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


class SetpointForeignKeys(Table):
    """When a setpoint on the device is another program's."""

    deviation_bar: Annotated[
        Positive, Field(description="how far the device's setpoint may be from ours")
    ] = 0.03
    lasting_ms: Annotated[
        Lasting,
        Field(
            description="for how long: above the time that a setpoint takes to the device and back"
        ),
    ] = 500.0


class SetpointForeign(Monitor):
    """What the device says it was told must lie between our last command and its lagged value.

    The lagged value allows for the time that the setpoint takes to the device and back.
    """

    fault = Fault(
        "setpoint_foreign",
        12,
        Policy.VENT,
        "the device has setpoints that are not ours: another program commands it too",
        "end the other program, or the device's own panel, then reset",
    )
    looks_at = "the setpoint that the device reports, against ours and ours lagged"
    how_to_set = "`lasting_ms` above the time to the device and back"
    keys = SetpointForeignKeys

    def __init__(self, arm: Arm, keys: SetpointForeignKeys) -> None:
        self._tolerance_pa, self._lasting_s = keys.deviation_bar * BAR, keys.lasting_ms * MS
        self._persistence = Persistence()

    def look(self, seen: Observation) -> str:
        """Name the chamber, its setpoint and ours; without setpoints there is nothing to see."""
        setpoints_pa = seen.setpoints_pa or []
        foreign = self._foreign(setpoints_pa, seen)
        if not self._persistence.longer(foreign >= 0, seen.now_s, self._lasting_s):
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
