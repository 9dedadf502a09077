"""The valve box as a kind of device: all that pneuarm knows of it.

Every process of the daemon loads this module. What is big, or waits, is imported where it is used.
"""

from argparse import Namespace
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Annotated

from pydantic import Field

from pneuarm.controllers.arm.arm import Arm
from pneuarm.controllers.arm.errors import ConfigurationError
from pneuarm.hardware.device import Address, EmulatedDevice, Emulation, TcpPort
from pneuarm.hardware.interface import Hardware
from pneuarm.hardware.tables.table import Table

if TYPE_CHECKING:
    from pneuarm.hardware.emulation.emulation import EmulatedArm


class ValveBoxConfig(Table):
    """The valve box, `[valve_box]` in the configuration."""

    host: Annotated[str, Field(description="name or address of the box; must be given")] = ""
    port: Annotated[int, Field(ge=1, le=65535, description="its port")] = 7000
    timeout_ms: Annotated[
        float, Field(ge=10, le=5000, description="an answer that takes longer is a lost device")
    ] = 200.0


class ValveBoxDevice(EmulatedDevice[ValveBoxConfig]):
    """A box of valves that speaks lines of text over TCP."""

    name = "valve-box"
    summary = "box of valves over TCP"
    config = ValveBoxConfig

    def build(self, config: ValveBoxConfig, arm: Arm) -> Hardware:
        """Make the adapter; raises ConfigurationError where nobody says where the box is."""
        from valve_box.adapter import ValveBox

        if not config.host:
            raise ConfigurationError('valve_box.host is missing: its address, "10.0.0.2"')
        return ValveBox(arm, config.host, config.port, config.timeout_ms * 1e-3)

    def address(self, config: ValveBoxConfig) -> Address:
        """Return its port on the network: one daemon a box."""
        return TcpPort(config.host, config.port)

    def left_behind(self, config: ValveBoxConfig) -> str:
        """Nothing: the box itself empties the arm when its host falls silent."""
        return ""

    @contextmanager
    def emulate(
        self, config: ValveBoxConfig, arm: Arm, emulated: "EmulatedArm", options: Namespace
    ) -> Iterator[Emulation]:
        """Put an emulated box on a free port of loopback."""
        from pneuarm.hardware.emulation.faults import PHYSICAL_WORDS
        from valve_box.emulator import WORDS, EmulatedValveBox

        with EmulatedValveBox(emulated) as box:
            table = {"host": "127.0.0.1", "port": box.port}
            yield Emulation(table, box.inject, WORDS + PHYSICAL_WORDS)


DEVICE = ValveBoxDevice()
