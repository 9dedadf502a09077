"""How old a measurement is: too old to hold on to, and so old that the device is lost."""

import math
from typing import Annotated

from pydantic import Field

from pneuarm.controllers.arm.arm import Arm
from pneuarm.hardware.interface import Measurement
from pneuarm.hardware.tables.table import Table
from pneuarm.service.monitors.fault import Fault, Policy
from pneuarm.service.monitors.monitor import MS, Monitor, Observation

_Age = Annotated[float, Field(ge=10, le=10000)]


#: A tick may begin so long (s) after it was due, and what is measured then is new.
_LATE_TICK_S = 0.1


def measurement_age_s(measurement: Measurement, now_s: float) -> float:
    """How old a measurement is; one taken while the tick was already due counts as new.

    A stamp further ahead is of another clock, and would be new for ever: it is as old as it is
    ahead. One that is no number is of no time.
    """
    if measurement.taken_s is None:
        return 0.0
    age_s = now_s - measurement.taken_s
    if math.isnan(age_s):
        return math.inf
    return 0.0 if -_LATE_TICK_S <= age_s < 0.0 else abs(age_s)


class _TooOld(Monitor):
    """Compares the age with what is allowed; the age itself is the persistence."""

    looks_at = "time since the device was read"
    needs_fresh = False

    def __init__(self, arm: Arm, keys: "MeasurementOldKeys | DeviceLostKeys") -> None:
        self._oldest_s = keys.oldest_ms * MS

    def look(self, seen: Observation) -> str:
        """Tell the age and what is allowed."""
        if seen.age_s <= self._oldest_s:
            return ""
        age_ms, allowed_ms = 1e3 * seen.age_s, 1e3 * self._oldest_s
        return f"the measurement is {age_ms:.0f} ms old (allowed: {allowed_ms:g} ms)"


class MeasurementOldKeys(Table):
    """When a device answers too late."""

    oldest_ms: Annotated[_Age, Field(description="how old a measurement may be")] = 150.0


class MeasurementOld(_TooOld):
    """The device answers too late. Where it does, nothing else looks at what it measured."""

    fault = Fault(
        "measurement_old",
        2,
        Policy.HOLD,
        "the device answers too late: a busy bus or network",
        "take other traffic off the bus, or allow monitors.measurement_old.oldest_ms; then enable "
        "again",
    )
    how_to_set = "a few of the device's periods"
    keys = MeasurementOldKeys


class DeviceLostKeys(Table):
    """When a device that answers no more is lost."""

    oldest_ms: Annotated[
        _Age, Field(description="a measurement older than this is a device that is lost")
    ] = 1000.0


class DeviceLost(_TooOld):
    """The device does not answer at all. A call to it that fails is the same fault."""

    fault = Fault(
        "device_lost",
        1,
        Policy.VENT,
        "the device does not answer: its cable, its power or its address",
        "see that the device has power and is connected, then reset",
    )
    how_to_set = "above `oldest_ms` of `[monitors.measurement_old]`, which holds before"
    keys = DeviceLostKeys
