"""Keys that devices on a serial port share."""

from typing import Annotated

from pydantic import Field

from pneuarm.controllers.arm.errors import ConfigurationError
from pneuarm.hardware.device import SerialPort
from pneuarm.hardware.tables.table import Table


class SerialConfig(Table):
    """Where a serial device is, and how fast its line is."""

    device: Annotated[
        str,
        Field(
            max_length=255,
            pattern=r"^[\x20-\x7e]*$",
            description="its serial port, best from `/dev/serial/by-id`; must be given",
        ),
    ] = ""
    baud: Annotated[int, Field(ge=1200, le=4_000_000, description="its speed")] = 115200

    @property
    def port(self) -> SerialPort:
        """The port, given or not."""
        return SerialPort(self.device)

    def device_for(self, table: str) -> str:
        """Return the path of the port; raises ConfigurationError where none is given."""
        if not self.device:
            raise ConfigurationError(
                f'{table}.device is missing: the path of its serial port, "/dev/serial/by-id/..."'
            )
        return self.device


Timeout = Annotated[float, Field(ge=100, le=5000)]
ConnectTimeout = Annotated[float, Field(gt=0, le=60)]
