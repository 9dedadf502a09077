"""VPPM valves on a CPX terminal behind the interface of every device."""

from collections import deque
from dataclasses import dataclass

import numpy as np

from pneuarm.controllers.arm.arm import Arm, Array
from pneuarm.controllers.arm.errors import HardwareError
from pneuarm.hardware.checked import checked_command
from pneuarm.hardware.festo.counts import counts_of, pressures_of
from pneuarm.hardware.festo.terminal_watchdog import KeptWatchdog, TerminalWatchdog
from pneuarm.hardware.festo_cpx.protocol import CpxInputs, CpxLayout, complaint
from pneuarm.hardware.interface import Measurement
from pneuarm.hardware.transports.modbus import ModbusTerminal

#: The terminal shows a setpoint some of its cycles late: one of these last writes must be it.
_REMEMBERED_WRITES = 8
_MISMATCHES = 3
#: A valve may round what it was told by this many counts.
_ROUNDED = 2

NAME = "festo_cpx"


@dataclass(frozen=True)
class CpxSettings:
    """Where the terminal is, and what is wired to it."""

    host: str
    port: int
    unit_id: int
    timeout_s: float
    layout: CpxLayout
    watchdog: TerminalWatchdog


class FestoCpx:
    """One arm on a CPX terminal, as a :class:`pneuarm.hardware.interface.Hardware`; I/O blocks."""

    def __init__(self, arm: Arm, settings: CpxSettings) -> None:
        self._arm, self._settings = arm, settings
        self._low_pa = arm.per_chamber("pressure_min_pa")
        self._high_pa = arm.per_chamber("pressure_max_pa")
        self._no_lengths = np.full((arm.n_sections, 3), np.nan)
        self._no_lengths.setflags(write=False)
        self._terminal = ModbusTerminal(
            NAME, settings.host, settings.port, settings.unit_id, settings.timeout_s
        )
        self._watchdog = KeptWatchdog(settings.watchdog, self._terminal, NAME)
        self._written: deque[list[int]] = deque(maxlen=_REMEMBERED_WRITES)
        self._mismatches = 0

    def connect(self) -> None:
        """Open the connection, zero every output, set the terminal's watchdog, read once."""
        self._terminal.connect()
        self._written.clear()
        self._mismatches = 0
        try:
            self._write_counts([0] * self._arm.n_chambers)
            self._watchdog.set()
            self._read_inputs()
        except HardwareError:
            self._terminal.close()
            raise

    def read(self, time_s: float) -> Measurement:
        """Return what the valves say, in one block; raises HardwareError for a foreign setpoint.

        Also where the terminal's watchdog is no longer as it was set: that is read back for ever.
        """
        inputs = self._read_inputs()
        self._check_setpoints(inputs)
        self._watchdog.look(time_s)
        n_sections = self._arm.n_sections
        valves = self._settings.layout.valves
        found = zip(valves, inputs.diagnosis, strict=True) if any(inputs.diagnosis) else ()
        return Measurement(
            pressures_pa=pressures_of(inputs.actual, n_sections),
            lengths_m=self._no_lengths,
            setpoints_pa=pressures_of(inputs.setpoint, n_sections),
            complaints=tuple(complaint(valve, word) for valve, word in found if word),
        )

    def write(self, pressures_pa: Array, time_s: float) -> Array:
        """Set gauge pressures (n_sections, 3); return them in whole millibars, as sent.

        Rounded toward ambient, and never outside the arm's limits: where these allow no vacuum no
        negative value is ever sent.
        """
        taken_pa = checked_command(pressures_pa, self._low_pa, self._high_pa, NAME)
        counts = counts_of(taken_pa)
        self._write_counts(counts)
        return pressures_of(counts, self._arm.n_sections)

    def vent(self, time_s: float) -> None:
        """Set every output to zero."""
        self._write_counts([0] * self._arm.n_chambers)

    def close(self) -> None:
        """Zero every output where that is still possible, and let the terminal go."""
        if self._terminal.connected:
            try:
                self._write_counts([0] * self._arm.n_chambers)
            except HardwareError:
                pass  # it is gone: its watchdog has to do it
            finally:
                self._terminal.close()

    def _write_counts(self, counts: list[int]) -> None:
        self._written.append(counts)  # before: a write without an answer may have arrived
        for address, registers in self._settings.layout.output_blocks(counts):
            self._terminal.write(address, registers)

    def _read_inputs(self) -> CpxInputs:
        layout = self._settings.layout
        wired = (
            f"{len(layout.valves)} valves at {NAME}.input_base = {layout.input_base}, one for "
            "every chamber"
        )
        return layout.decode(self._terminal.read_wired(layout.input_block, wired))

    def _check_setpoints(self, inputs: CpxInputs) -> None:
        """Raise where the terminal has long shown a setpoint that none of our writes was."""
        if inputs.setpoint == self._written[-1]:
            self._mismatches = 0
            return
        foreign = [
            index
            for index, shown in enumerate(inputs.setpoint)
            if all(abs(shown - counts[index]) > _ROUNDED for counts in self._written)
        ]
        self._mismatches = self._mismatches + 1 if foreign else 0
        if self._mismatches >= _MISMATCHES:
            index = foreign[0]
            raise HardwareError(
                f"{NAME}: valve {self._settings.layout.valves[index]} holds the setpoint "
                f"{inputs.setpoint[index]} mbar, but {self._written[-1][index]} mbar was written; "
                "its watchdog has run out, or another program writes to the terminal"
            )
