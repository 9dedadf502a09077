"""A VTEM motion terminal behind the interface of every device."""

import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from pneuarm.controllers.arm.arm import Arm, Array
from pneuarm.controllers.arm.errors import HardwareError
from pneuarm.hardware.checked import checked_command
from pneuarm.hardware.festo.counts import counts_of, pressures_of
from pneuarm.hardware.festo.terminal_watchdog import KeptWatchdog, TerminalWatchdog
from pneuarm.hardware.festo_vtem.protocol import (
    ACKNOWLEDGE_COMMAND,
    IDLE,
    OFF,
    OFF_COMMAND,
    PRESSURE_REGULATION,
    REGULATE_COMMAND,
    REGULATING,
    VtemInputs,
    VtemLayout,
    app_and_state,
)
from pneuarm.hardware.interface import Measurement
from pneuarm.hardware.transports.modbus import ModbusTerminal

NAME = "festo_vtem"

_ACKNOWLEDGE_S = 0.5
_EXHAUST_S = 1.0
_OFF_S = 2.0
#: While it waits it goes on writing, so that the terminal's watchdog stays content.
_POLL_S = 0.05


@dataclass(frozen=True)
class VtemSettings:
    """Where the terminal is, and what is wired to it."""

    host: str
    port: int
    unit_id: int
    timeout_s: float
    start_timeout_s: float
    layout: VtemLayout
    watchdog: TerminalWatchdog


class FestoVtem:
    """One arm on a VTEM. It satisfies :class:`pneuarm.hardware.interface.Hardware`; I/O blocks."""

    def __init__(
        self, arm: Arm, settings: VtemSettings, sleep: Callable[[float], None] = time.sleep
    ) -> None:
        self._arm, self._settings, self._sleep = arm, settings, sleep
        self._low_pa = arm.per_chamber("pressure_min_pa")
        self._high_pa = arm.per_chamber("pressure_max_pa")
        self._zeros = [0] * arm.n_chambers
        self._terminal = ModbusTerminal(
            NAME, settings.host, settings.port, settings.unit_id, settings.timeout_s
        )
        self._watchdog = KeptWatchdog(settings.watchdog, self._terminal, NAME)

    def connect(self) -> None:
        """Open the connection, zero every output, and start pressure regulation if it is off."""
        self._terminal.connect()
        try:
            self._write(REGULATE_COMMAND, self._zeros)
            self._watchdog.set()
            if self._inputs().slots_not_in(PRESSURE_REGULATION, REGULATING):
                self._start()
        except HardwareError:
            self._terminal.close()
            raise

    def _start(self) -> None:
        """Acknowledge what was wrong, then ask for pressure regulation and wait for it."""
        self._repeat(ACKNOWLEDGE_COMMAND, _ACKNOWLEDGE_S, lambda inputs: False)
        waited_s = self._settings.start_timeout_s
        inputs = self._repeat(
            REGULATE_COMMAND,
            waited_s,
            lambda inputs: not inputs.slots_not_in(PRESSURE_REGULATION, REGULATING),
        )
        for slot in inputs.slots_not_in(PRESSURE_REGULATION, REGULATING):
            app, state = app_and_state(inputs.status[slot])
            raise HardwareError(
                f"{NAME}: slot {slot} does not regulate pressure after {waited_s:g} s (app {app}, "
                f"state {state}; wanted: app {PRESSURE_REGULATION}, state {REGULATING}); check "
                "its supply and its licence for the app"
            )

    def _repeat(
        self, command: int, at_most_s: float, done: Callable[[VtemInputs], bool]
    ) -> VtemInputs:
        """Give a command with zeros until something is so, or the time is up."""
        for _ in range(max(1, round(at_most_s / _POLL_S))):
            self._write(command, self._zeros)
            inputs = self._inputs()
            if done(inputs):
                return inputs
            self._sleep(_POLL_S)
        return self._inputs()

    def read(self, time_s: float) -> Measurement:
        """Return what the slots say; raises HardwareError where one has stopped regulating.

        Also where the terminal's watchdog is no longer as it was set: that is read back for ever.
        """
        inputs = self._inputs()
        for slot in inputs.slots_not_in(PRESSURE_REGULATION, REGULATING):
            app, state = app_and_state(inputs.status[slot])
            raise HardwareError(
                f"{NAME}: slot {slot} has left pressure regulation (app {app}, state {state}); "
                "look at the terminal for the cause"
            )
        self._watchdog.look(time_s)
        n_sections = self._arm.n_sections
        return Measurement(
            pressures_pa=pressures_of(inputs.actual, n_sections),
            lengths_m=np.full((n_sections, 3), np.nan),
        )

    def write(self, pressures_pa: Array, time_s: float) -> Array:
        """Set gauge pressures (n_sections, 3); return them in whole millibars, as sent."""
        taken_pa = checked_command(pressures_pa, self._low_pa, self._high_pa, NAME)
        counts = counts_of(taken_pa)
        self._write(REGULATE_COMMAND, counts)
        return pressures_of(counts, self._arm.n_sections)

    def vent(self, time_s: float) -> None:
        """Set every output to zero; the slots go on regulating, which empties the chambers."""
        self._write(REGULATE_COMMAND, self._zeros)

    def close(self) -> None:
        """Exhaust for a second, switch the slots off where that is still possible, and let go."""
        if not self._terminal.connected:
            return
        try:
            self._repeat(REGULATE_COMMAND, _EXHAUST_S, lambda inputs: False)
            self._repeat(OFF_COMMAND, _OFF_S, lambda inputs: not inputs.slots_not_in(OFF, IDLE))
        except HardwareError:
            pass  # it is gone: its watchdog has to do it
        finally:
            self._terminal.close()

    def _write(self, command: int, counts: list[int]) -> None:
        for address, registers in self._settings.layout.output_blocks(command, counts):
            self._terminal.write(address, registers)

    def _inputs(self) -> VtemInputs:
        layout = self._settings.layout
        wired = (
            f"{len(layout.slots)} slots at {NAME}.input_base = {layout.input_base}, one for every "
            "two valves"
        )
        return layout.decode(self._terminal.read_wired(layout.input_block, wired))
