"""The ESP32 controller of three chambers as a kind of device."""

from argparse import Namespace
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Annotated

from pydantic import Field

from pneuarm.controllers.arm.arm import Arm
from pneuarm.controllers.arm.errors import ConfigurationError
from pneuarm.hardware.channels import Channels, valves_or_all
from pneuarm.hardware.device import Address, EmulatedDevice, Emulation
from pneuarm.hardware.esp32.protocol import CHAMBERS
from pneuarm.hardware.interface import Hardware
from pneuarm.hardware.tables.table import BAR
from pneuarm.hardware.transports.serial_table import ConnectTimeout, SerialConfig, Timeout

if TYPE_CHECKING:
    from pneuarm.hardware.emulation.emulation import EmulatedArm


class Esp32Config(SerialConfig):
    """An ESP32 controller of three chambers.

    How to wire it: [hardware.md](hardware.md#esp32-with-three-chambers).
    """

    valves: Annotated[
        tuple[Annotated[int, Field(ge=0, le=2)], ...],
        Field(
            max_length=3,
            strict=False,
            description="the controller's chamber of each of the arm's: 0, 1 and 2 in any order; "
            "empty: 0, 1, 2",
        ),
    ] = ()
    potentiometers: Annotated[
        tuple[Annotated[tuple[Annotated[int, Field(ge=1, le=6)], ...], Field(strict=False)], ...],
        Field(
            max_length=3,
            strict=False,
            description="for each chamber a list of the potentiometers, 1 to 6, whose mean is its "
            "length; empty: no lengths are measured",
        ),
    ] = ()
    ceiling_bar: Annotated[
        float,
        Field(
            gt=0,
            le=0.13,
            description="an arm whose `pressure_max_bar` is above this, or whose "
            "`pressure_min_bar` is below 0, is refused",
        ),
    ] = 0.13
    timeout_ms: Annotated[
        Timeout, Field(description="no feedback for this long is a lost device")
    ] = 500.0
    connect_timeout_s: Annotated[
        ConnectTimeout,
        Field(
            description="how long it may take to start, which opening the port makes most of "
            "these boards do"
        ),
    ] = 8.0

    def wiring(self, arm: Arm) -> Channels:
        """Return which of its chambers is which of the arm's; raises ConfigurationError."""
        if arm.n_chambers != CHAMBERS:
            raise ConfigurationError(
                f"adapter 'esp32' has {CHAMBERS} chambers and arm {arm.name!r} has "
                f"{arm.n_chambers}: it moves arms of one section"
            )
        return Channels(arm, CHAMBERS, valves_or_all(self.valves, CHAMBERS), "esp32.valves")


class Esp32Controller(EmulatedDevice[Esp32Config]):
    """The open firmware `luqmanroslan/soft-robotics-esp32-firmware`, over USB serial."""

    name = "esp32"
    summary = "ESP32 controller of three chambers"
    config = Esp32Config
    #: Its pump gives 0.13 bar: chambers that are soft enough lengthen as far under less.
    demo_section = {
        "pressure_min_bar": 0.0,
        "pressure_max_bar": 0.12,
        "pressure_slew_max_bar_s": 0.6,
        "lengthening_mm_per_bar": 500.0,
        "softening_mm_per_bar2": 0.0,
    }

    def build(self, config: Esp32Config, arm: Arm) -> Hardware:
        """Make the adapter; raises ConfigurationError for a wrong wiring."""
        from pneuarm.hardware.esp32.adapter import Esp32, Esp32Settings

        settings = Esp32Settings(
            device=config.device_for(self.table),
            valves=config.wiring(arm).of_chambers,
            potentiometers=config.potentiometers,
            baud=config.baud,
            ceiling_pa=config.ceiling_bar * BAR,
            timeout_s=config.timeout_ms * 1e-3,
            connect_timeout_s=config.connect_timeout_s,
        )
        return Esp32(arm, settings)

    def address(self, config: Esp32Config) -> Address:
        """Return its serial port."""
        return config.port

    def left_behind(self, config: Esp32Config) -> str:
        """Everything: it regulates the last setpoints for ever, whether its host lives or not."""
        return (
            "the ESP32 controller has no watchdog on its host: when this PC or the USB cable dies, "
            "it goes on regulating the last pressures, and when the controller itself loses its "
            "power, its closed valves keep the air in the chambers until it has power again"
        )

    @contextmanager
    def emulate(
        self, config: Esp32Config, arm: Arm, emulated: "EmulatedArm", options: Namespace
    ) -> Iterator[Emulation]:
        """Put an emulated controller on a pseudo-terminal; potentiometers in two rows of three."""
        from pneuarm.hardware.esp32.emulator import Esp32Emulator
        from pneuarm.hardware.transports.pseudo_terminal import emulation_on_a_terminal

        channels = config.wiring(arm)
        valves = channels.of_chambers
        table = {
            "valves": list(valves),
            "potentiometers": [[valve + 1, valve + 1 + CHAMBERS] for valve in valves],
        }
        with emulation_on_a_terminal(Esp32Emulator(emulated, channels), emulated, table) as running:
            yield running


DEVICE = Esp32Controller()
