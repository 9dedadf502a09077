"""A VTEM motion terminal as a kind of device."""

from argparse import Namespace
from contextlib import AbstractContextManager
from typing import TYPE_CHECKING, Annotated

from pydantic import Field

from pneuarm.controllers.arm.arm import Arm
from pneuarm.hardware.device import Emulation
from pneuarm.hardware.festo.terminal import (
    FestoConfig,
    FestoTerminal,
    WideStride,
    watchdog_at_power_on,
)
from pneuarm.hardware.interface import Hardware

if TYPE_CHECKING:
    from pneuarm.hardware.emulation.emulation import EmulatedArm
    from pneuarm.hardware.festo_vtem.protocol import VtemLayout


class FestoVtemConfig(FestoConfig):
    """A VTEM motion terminal; a slot drives two valves and takes three registers.

    How to wire it: [hardware.md](hardware.md#festo-vtem).
    """

    output_stride: Annotated[
        WideStride, Field(description="output registers from one slot to the next")
    ] = 3
    start_timeout_s: Annotated[
        float,
        Field(gt=0, le=60, description="how long the slots may take to load pressure regulation"),
    ] = 20.0

    def layout(self, arm: Arm) -> "VtemLayout":
        """Return where the slots lie."""
        from pneuarm.hardware.festo_vtem.protocol import VtemLayout

        return VtemLayout(
            valves=self.wired_valves(arm),
            output_base=self.output_base,
            output_stride=self.output_stride,
            input_base=self.input_base,
            input_stride=self.input_stride,
        )


class FestoVtemTerminal(FestoTerminal[FestoVtemConfig]):
    """A VTEM; the watchdog is that of the CPX node it sits on."""

    name = "festo-vtem"
    summary = "Festo VTEM motion terminal"
    config = FestoVtemConfig
    valves_per_stride = 2

    def build(self, config: FestoVtemConfig, arm: Arm) -> Hardware:
        """Make the adapter; raises ConfigurationError for a wrong wiring."""
        from pneuarm.hardware.festo_vtem.adapter import FestoVtem, VtemSettings

        self.check_wiring(config, arm)
        settings = VtemSettings(
            host=config.host,
            port=config.port,
            unit_id=config.unit_id,
            timeout_s=config.timeout_ms * 1e-3,
            start_timeout_s=config.start_timeout_s,
            layout=config.layout(arm),
            watchdog=config.watchdog,
        )
        return FestoVtem(arm, settings)

    def emulate(
        self, config: FestoVtemConfig, arm: Arm, emulated: "EmulatedArm", options: Namespace
    ) -> AbstractContextManager[Emulation]:
        """Put an emulated terminal on a port of loopback."""
        from pneuarm.hardware.festo_vtem.emulator import EmulatedVtem

        watchdog, hold = watchdog_at_power_on(config, options), options.fail_safe == "hold"
        terminal = EmulatedVtem(emulated, config.layout(arm), watchdog, hold)
        return self._serve(config, arm, terminal, emulated, options.port)


DEVICE = FestoVtemTerminal()
