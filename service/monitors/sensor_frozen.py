"""A sensor that repeats itself bit by bit while its command moves."""

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


class SensorFrozenKeys(Table):
    """When a reading stands still."""

    moved_bar: Annotated[
        Positive,
        Field(
            description=(
                "how far the expected pressure may move while the reading repeats itself bit by bit"
            )
        ),
    ] = 0.05
    lasting_ms: Lasting = 200.0


class SensorFrozen(Monitor):
    """How far the expected pressure has moved since the reading last changed by even one bit.

    No time alone makes a reading frozen: a device that rounds to a millibar may well say the same
    for hours at a constant pressure, and one that is read at 50 Hz repeats itself in between.
    """

    fault = Fault(
        "sensor_frozen",
        4,
        Policy.RAMP,
        "a pressure reading stands still while its command moves: a dead sensor or a stuck valve",
        "look at the sensor and the valve of the chamber that the event names, then reset",
    )
    looks_at = "a reading that is the same to the bit while its expected pressure moves"
    how_to_set = (
        "above the valve's hysteresis. A reading that stands still at a constant command is no "
        "fault, so coarse and slow sensors are welcome"
    )
    keys = SensorFrozenKeys

    def __init__(self, arm: Arm, keys: SensorFrozenKeys) -> None:
        self._moved_pa, self._lasting_s = keys.moved_bar * BAR, keys.lasting_ms * MS
        self._persistence = Persistence()
        self._reading_pa: list[float] = []
        self._expected_pa: list[float] = []

    def look(self, seen: Observation) -> str:
        """Name the chamber and the reading at which it stands."""
        if not self._reading_pa:
            self._reading_pa, self._expected_pa = list(seen.measured_pa), list(seen.expected_pa)
        frozen = -1
        pairs = zip(seen.measured_pa, seen.expected_pa, strict=True)
        for index, (reading, expected) in enumerate(pairs):
            if reading != self._reading_pa[index]:
                self._reading_pa[index], self._expected_pa[index] = reading, expected
            elif abs(expected - self._expected_pa[index]) > self._moved_pa:
                frozen = index
        if not self._persistence.longer(frozen >= 0, seen.now_s, self._lasting_s):
            return ""
        moved_pa = abs(seen.expected_pa[frozen] - self._expected_pa[frozen])
        reading_pa = self._reading_pa[frozen]
        return (
            f"{chamber(frozen)} stands at {bar(reading_pa)} while its command moved {bar(moved_pa)}"
        )
