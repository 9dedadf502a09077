"""A CPX terminal with VPPM valves as a kind of device."""

from argparse import Namespace
from contextlib import AbstractContextManager
from typing import TYPE_CHECKING

from pneuarm.controllers.arm.arm import Arm
from pneuarm.hardware.device import Emulation
from pneuarm.hardware.festo.terminal import FestoConfig, FestoTerminal, watchdog_at_power_on
from pneuarm.hardware.interface import Hardware

if TYPE_CHECKING:
    from pneuarm.hardware.emulation.emulation import EmulatedArm
    from pneuarm.hardware.festo_cpx.protocol import CpxLayout


class FestoCpxConfig(FestoConfig):
    """A CPX terminal with VPPM valves, a register each.

    How to wire it: [hardware.md](hardware.md#festo-cpx-with-proportional-valves).
    """

    def layout(self, arm: Arm) -> "CpxLayout":
        """Return where the valves lie."""
        from pneuarm.hardware.festo_cpx.protocol import CpxLayout

        return CpxLayout(
            valves=self.wired_valves(arm),
            output_base=self.output_base,
            output_stride=self.output_stride,
            input_base=self.input_base,
            input_stride=self.input_stride,
        )


class FestoCpxTerminal(FestoTerminal[FestoCpxConfig]):
    """A CPX terminal; its own watchdog zeroes the valves."""

    name = "festo-cpx"
    summary = "Festo CPX terminal with VPPM valves"
    config = FestoCpxConfig

    def build(self, config: FestoCpxConfig, arm: Arm) -> Hardware:
        """Make the adapter; raises ConfigurationError for a wrong wiring."""
        from pneuarm.hardware.festo_cpx.adapter import CpxSettings, FestoCpx

        self.check_wiring(config, arm)
        settings = CpxSettings(
            host=config.host,
            port=config.port,
            unit_id=config.unit_id,
            timeout_s=config.timeout_ms * 1e-3,
            layout=config.layout(arm),
            watchdog=config.watchdog,
        )
        return FestoCpx(arm, settings)

    def emulate(
        self, config: FestoCpxConfig, arm: Arm, emulated: "EmulatedArm", options: Namespace
    ) -> AbstractContextManager[Emulation]:
        """Put an emulated terminal on a port of loopback."""
        from pneuarm.hardware.festo_cpx.emulator import EmulatedCpx

        watchdog, hold = watchdog_at_power_on(config, options), options.fail_safe == "hold"
        terminal = EmulatedCpx(emulated, config.layout(arm), watchdog, hold)
        return self._serve(config, arm, terminal, emulated, options.port)


DEVICE = FestoCpxTerminal()
