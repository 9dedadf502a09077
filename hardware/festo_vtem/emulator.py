"""An emulated VTEM: slots with apps in front of an emulated arm."""

from dataclasses import dataclass

import numpy as np

from pneuarm.hardware.emulation.emulation import EmulatedArm
from pneuarm.hardware.festo.counts import COUNT_PA
from pneuarm.hardware.festo.emulated_registers import measured_counts, read_from
from pneuarm.hardware.festo.emulated_watchdog import EmulatedWatchdog
from pneuarm.hardware.festo.terminal_watchdog import TerminalWatchdog
from pneuarm.hardware.festo_vtem.protocol import (
    ACKNOWLEDGE_COMMAND,
    IDLE,
    OFF,
    OFF_COMMAND,
    PRESSURE_REGULATION,
    REGULATE_COMMAND,
    REGULATING,
    VtemLayout,
    command_word,
)
from pneuarm.hardware.transports.modbus import to_signed

#: How long a slot takes to load pressure regulation.
_LOAD_S = 0.3


@dataclass
class _Slot:
    """It regulates only after it was acknowledged, and then asked for the app."""

    app: int = OFF
    state: int = IDLE
    acknowledged: bool = False
    loading_until_s: float | None = None
    counts: tuple[int, int] = (0, 0)

    def command(self, word: int, counts: tuple[int, int], now_s: float) -> None:
        self.counts = counts
        if word == ACKNOWLEDGE_COMMAND:
            self.acknowledged = True
        elif word == OFF_COMMAND:
            self.app, self.state, self.acknowledged = OFF, IDLE, False
            self.loading_until_s = None
        elif word == REGULATE_COMMAND and self.app == OFF and self.acknowledged:
            if self.loading_until_s is None:
                self.loading_until_s = now_s + _LOAD_S
            elif now_s > self.loading_until_s:
                self.app, self.state = PRESSURE_REGULATION, REGULATING

    @property
    def regulated(self) -> tuple[int, int]:
        """The counts it regulates to: none while the app does not run."""
        return self.counts if self.app == PRESSURE_REGULATION else (0, 0)


class EmulatedVtem:
    """A motion terminal with as many slots as the layout needs."""

    def __init__(
        self,
        arm: EmulatedArm,
        layout: VtemLayout,
        watchdog: TerminalWatchdog,
        hold: bool = False,
        n_slots: int | None = None,
    ) -> None:
        self._arm, self._layout = arm, layout
        self._watchdog = EmulatedWatchdog(arm, watchdog, hold)
        self._slots = [_Slot() for _ in range(n_slots or layout.slots[-1] + 1)]

    def touched(self, now_s: float) -> None:
        """Somebody has asked for something."""
        self._watchdog.touched(now_s)

    def step(self, now_s: float) -> None:
        """Let the air move and the watchdog run."""
        self._arm.advance(now_s)
        if self._watchdog.step(now_s):
            for slot in self._slots:
                slot.counts = (0, 0)

    def read(self, address: int, count: int) -> list[int] | None:
        """Return registers, None where one of them is not there."""
        return read_from(self._inputs() | self._watchdog.registers(), address, count)

    def _inputs(self) -> dict[int, int]:
        layout, found = self._layout, {}
        for number, slot in enumerate(self._slots):
            first = layout.input_base + layout.input_stride * number
            found[first] = command_word(slot.app, slot.state)
            for index in range(2):
                actual = measured_counts(self._arm, layout.valves, 2 * number + index)
                found[first + 1 + index] = actual
        return found

    def write(self, address: int, values: list[int], now_s: float) -> bool:
        """Take whole slots, or the watchdog's time; False for anything else."""
        layout = self._layout
        if self._watchdog.takes(address, values):
            return True
        first, rest = divmod(address - layout.output_base, layout.output_stride)
        count, odd = divmod(len(values), layout.output_stride)
        if rest or odd or not 0 <= first <= first + count <= len(self._slots):
            return False
        for index in range(count):
            word, one, two, *_ = values[layout.output_stride * index :]
            self._slots[first + index].command(word, (to_signed(one), to_signed(two)), now_s)
        self._regulate(now_s)
        return True

    def _regulate(self, now_s: float) -> None:
        counts = [self._slots[valve // 2].regulated[valve % 2] for valve in self._layout.valves]
        self._arm.set_pressures_pa(np.array(counts) * COUNT_PA, now_s)
