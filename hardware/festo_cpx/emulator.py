"""An emulated CPX terminal: registers in front of an emulated arm."""

import numpy as np

from pneuarm.hardware.emulation.emulation import EmulatedArm
from pneuarm.hardware.festo.counts import COUNT_PA
from pneuarm.hardware.festo.emulated_registers import measured_counts, read_from
from pneuarm.hardware.festo.emulated_watchdog import EmulatedWatchdog
from pneuarm.hardware.festo.terminal_watchdog import TerminalWatchdog
from pneuarm.hardware.festo_cpx.protocol import CpxLayout
from pneuarm.hardware.transports.modbus import to_signed

#: The terminal's first valve is fed by this much at most, counts of 1 mbar.
_LARGEST_COUNT = 10_000


class EmulatedCpx:
    """A terminal with ``n_valves`` valves; those of the layout move the chambers."""

    def __init__(
        self,
        arm: EmulatedArm,
        layout: CpxLayout,
        watchdog: TerminalWatchdog,
        hold: bool = False,
        n_valves: int | None = None,
    ) -> None:
        self._arm, self._layout = arm, layout
        self._watchdog = EmulatedWatchdog(arm, watchdog, hold)
        n_valves = max(layout.valves) + 1 if n_valves is None else n_valves
        self._counts = [0] * n_valves

    def touched(self, now_s: float) -> None:
        """Somebody has asked for something."""
        self._watchdog.touched(now_s)

    def step(self, now_s: float) -> None:
        """Let the air move and the watchdog run."""
        self._arm.advance(now_s)
        if self._watchdog.step(now_s):
            self._counts = [0] * len(self._counts)

    def read(self, address: int, count: int) -> list[int] | None:
        """Return registers, None where one of them is not there."""
        return read_from(self._registers() | self._watchdog.registers(), address, count)

    def _registers(self) -> dict[int, int]:
        layout = self._layout
        found: dict[int, int] = {}
        for valve, count in enumerate(self._counts):
            found[layout.output_base + layout.output_stride * valve] = count
            first = layout.input_base + layout.input_stride * valve
            actual = measured_counts(self._arm, layout.valves, valve)
            found |= {first: actual, first + 1: count, first + 2: 0}
        return found

    def write(self, address: int, values: list[int], now_s: float) -> bool:
        """Take setpoints, or the watchdog's time; False where a register is not there."""
        layout = self._layout
        if self._watchdog.takes(address, values):
            return True
        outputs = {
            layout.output_base + layout.output_stride * valve: valve
            for valve in range(len(self._counts))
        }
        wanted = range(address, address + len(values))
        if not all(number in outputs for number in wanted):
            return False
        for number, value in zip(wanted, values, strict=True):
            self._counts[outputs[number]] = min(to_signed(value), _LARGEST_COUNT)
        counts = np.array([self._counts[valve] for valve in layout.valves])
        self._arm.set_pressures_pa(counts * COUNT_PA, now_s)
        return True
