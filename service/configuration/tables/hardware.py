"""The device that moves the air."""

from math import inf
from typing import Annotated

from pydantic import AfterValidator, Field
from pydantic_core import PydanticCustomError

from pneuarm.controllers.arm.errors import ConfigurationError
from pneuarm.hardware.simulator.device import DEVICE as SIMULATOR
from pneuarm.hardware.tables.table import BAR, NotNegative, Table
from pneuarm.service.configuration.devices import devices


def _installed(name: str) -> str:
    try:
        devices().named(name)
    except ConfigurationError as error:
        raise PydanticCustomError("device", "{reason}", {"reason": str(error)}) from error
    return name


class HardwareConfig(Table):
    """The device that moves the air."""

    adapter: Annotated[
        str,
        AfterValidator(_installed),
        Field(
            json_schema_extra={"enum": list(devices().usable)},
            description="the device; each has a table of its own, and a page in "
            "[hardware.md](hardware.md)",
        ),
    ] = SIMULATOR.name
    device: Annotated[
        str,
        Field(
            max_length=64,
            pattern=r"^[\x20-\x7e]*$",
            description="name of a device that is in this machine's memory; the lock is on it, so "
            "one device has one daemon whatever the arm is called. Empty: one for each arm name",
        ),
    ] = ""
    exchange_rate_hz: Annotated[
        float,
        Field(
            ge=10,
            le=1000,
            description="how often the device process writes and reads, at most "
            "`control.rate_hz`; a slower device gets as much as it takes, and the loop keeps its "
            "own rate",
        ),
    ] = 200.0
    accept_no_watchdog: Annotated[
        bool,
        Field(
            description="start a device that has no watchdog of its own; the start then says what "
            "stays in the arm when this machine dies"
        ),
    ] = False
    supply_flow_max_bar_s: Annotated[
        NotNegative,
        Field(
            description="the sum of all chambers' rises in a second that the supply can feed. The "
            "guard shortens all rises by one factor to stay below it, falls are free. 0: a supply "
            "without limit",
        ),
    ] = 0.0

    @property
    def supply_flow_limit_pa_s(self) -> float:
        """The sum of all rises that the supply can feed, in SI units."""
        return self.supply_flow_max_bar_s * BAR or inf
