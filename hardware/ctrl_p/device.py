"""The Ctrl-P pressure controller as a kind of device."""

from argparse import Namespace
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Annotated

from pydantic import Field

from pneuarm.controllers.arm.arm import Arm
from pneuarm.hardware.channels import Channels, valves_or_all
from pneuarm.hardware.device import Address, EmulatedDevice, Emulation
from pneuarm.hardware.interface import Hardware
from pneuarm.hardware.tables.table import BAR, Positive
from pneuarm.hardware.transports.serial_table import ConnectTimeout, SerialConfig, Timeout

if TYPE_CHECKING:
    from pneuarm.hardware.emulation.emulation import EmulatedArm


class CtrlPConfig(SerialConfig):
    """A Ctrl-P pressure controller.

    How to wire it: [hardware.md](hardware.md#ctrl-p-pressure-controller).
    """

    channels: Annotated[
        int,
        Field(
            ge=3,
            le=64,
            description="how many channels the firmware was built for; another number is refused "
            "when it connects",
        ),
    ] = 8
    valves: Annotated[
        tuple[Annotated[int, Field(ge=0, le=63)], ...],
        Field(
            max_length=48,
            strict=False,
            description="the channel of each chamber, in the order of the chambers, none twice; "
            "empty: 0, 1, 2, ...",
        ),
    ] = ()
    ceiling_bar: Annotated[
        Positive,
        Field(
            description="above this pressure the controller empties every channel by itself; an "
            "arm whose `pressure_max_bar` is above it is refused"
        ),
    ] = 1.5
    telemetry_ms: Annotated[
        int,
        Field(
            ge=5,
            le=200,
            description="time between two readings, which is the pace of the exchange",
        ),
    ] = 20
    timeout_ms: Annotated[
        Timeout, Field(description="no telemetry for this long is a lost device")
    ] = 500.0
    connect_timeout_s: Annotated[
        ConnectTimeout, Field(description="how long each answer may take when it connects")
    ] = 3.0

    def wiring(self, arm: Arm) -> Channels:
        """Return which channel feeds which chamber; raises ConfigurationError where it cannot."""
        valves = valves_or_all(self.valves, arm.n_chambers)
        return Channels(arm, self.channels, valves, "ctrl_p.valves")


class CtrlPController(EmulatedDevice[CtrlPConfig]):
    """The open controller `cbteeple/pressure_controller`, over USB serial."""

    name = "ctrl-p"
    summary = "Ctrl-P pressure controller"
    config = CtrlPConfig

    def build(self, config: CtrlPConfig, arm: Arm) -> Hardware:
        """Make the adapter; raises ConfigurationError for a wrong wiring."""
        from pneuarm.hardware.ctrl_p.adapter import CtrlP, CtrlPSettings

        settings = CtrlPSettings(
            device=config.device_for(self.table),
            valves=config.wiring(arm).of_chambers,
            channels=config.channels,
            baud=config.baud,
            ceiling_pa=config.ceiling_bar * BAR,
            telemetry_s=config.telemetry_ms * 1e-3,
            timeout_s=config.timeout_ms * 1e-3,
            connect_timeout_s=config.connect_timeout_s,
        )
        return CtrlP(arm, settings)

    def address(self, config: CtrlPConfig) -> Address:
        """Return its serial port."""
        return config.port

    def left_behind(self, config: CtrlPConfig) -> str:
        """Everything: it regulates the last setpoints for ever, whether its host lives or not."""
        return (
            "the Ctrl-P controller has no watchdog on its host: when this PC or the USB cable "
            "dies, it goes on regulating the last pressures, and when the controller itself loses "
            "its power, its closed valves keep the air in the chambers"
        )

    @contextmanager
    def emulate(
        self, config: CtrlPConfig, arm: Arm, emulated: "EmulatedArm", options: Namespace
    ) -> Iterator[Emulation]:
        """Put an emulated controller on a pseudo-terminal; its ceiling is above the arm's limit."""
        from pneuarm.hardware.ctrl_p.emulator import CtrlPEmulator
        from pneuarm.hardware.transports.pseudo_terminal import emulation_on_a_terminal

        channels = config.wiring(arm)
        largest_bar = float(arm.per_chamber("pressure_max_pa").max()) / BAR
        table = {
            "channels": config.channels,
            "valves": list(channels.of_chambers),
            "ceiling_bar": max(config.ceiling_bar, 1.25 * largest_bar),
        }
        with emulation_on_a_terminal(CtrlPEmulator(emulated, channels), emulated, table) as running:
            yield running


DEVICE = CtrlPController()
