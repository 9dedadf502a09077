"""A pressure that does not follow its command: a stuck valve, a kinked or burst tube."""

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

#: By how much the true lag may differ from the configured one, as a fraction. In a fast move it
#: errs by this fraction of what the valve has still to go.
LAG_UNCERTAINTY = 0.5


class PressureDeviatesKeys(Table):
    """When a pressure does not follow its command."""

    deviation_bar: Annotated[
        Positive,
        Field(
            description=(
                "how far a pressure may be from the one expected: the pressure sent, through the "
                "dead time and the lags of `[arm.response]`; in a move half of what the valve has "
                "still to go is allowed besides"
            )
        ),
    ] = 0.1
    lasting_ms: Lasting = 300.0
    vent_timeout_s: Annotated[
        float,
        Field(
            gt=0,
            le=600,
            description=(
                "for how long while vented: how fast a chamber empties is a matter of its tubes"
            ),
        ),
    ] = 3.0


class PressureDeviates(Monitor):
    """Compares with the first-order prediction; what the valve may lag is allowed for.

    A vented chamber has longer: how fast it empties is a matter of its tubes, not of its valve.
    """

    fault = Fault(
        "pressure_deviates",
        6,
        Policy.RAMP,
        "a pressure does not follow its command: a stuck valve, a kinked, loose or burst tube",
        "look at the valve and the tube of the chamber that the event names, then reset",
    )
    looks_at = (
        "measured against the command through the valve's dead time and its first-order lag of "
        "filling or exhausting"
    )
    how_to_set = (
        "let `pneuarm calibrate` measure `delay_ms`, `filling_lag_ms` and `exhausting_lag_ms` of "
        "`[arm.response]`; or record a session with fast moves, set them so that the lagged "
        "command lies on the measured pressure, and `deviation_bar` to twice the largest distance "
        "that is left. Long tubes: a longer `vent_timeout_s`"
    )
    keys = PressureDeviatesKeys

    def __init__(self, arm: Arm, keys: PressureDeviatesKeys) -> None:
        self._tolerance_pa = keys.deviation_bar * BAR
        self._lasting_s, self._vent_timeout_s = keys.lasting_ms * MS, keys.vent_timeout_s
        self._persistence = Persistence()
        self._active = False

    def look(self, seen: Observation) -> str:
        """Name the chamber, what it measures and what was expected."""
        index = self._deviating(seen)
        in_fault = self._active or not seen.vented
        needed_s = self._lasting_s if in_fault else self._vent_timeout_s
        self._active = self._persistence.longer(index >= 0, seen.now_s, needed_s)
        if not self._active:
            return ""
        measured, expected = seen.measured_pa[index], seen.expected_pa[index]
        return f"{chamber(index)} has {bar(measured)}; {bar(expected)} was expected"

    def _deviating(self, seen: Observation) -> int:
        tolerance_pa = self._tolerance_pa
        triples = zip(seen.measured_pa, seen.expected_pa, seen.sent_pa, strict=True)
        for index, (measured, expected, sent) in enumerate(triples):
            to_go_pa = abs(sent - expected)
            if abs(measured - expected) > tolerance_pa + LAG_UNCERTAINTY * to_go_pa:
                return index
        return -1
