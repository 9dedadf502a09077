"""The watchdog inside a Festo terminal: set at the connection, and read back for ever."""

from dataclasses import dataclass

from pneuarm.controllers.arm.errors import HardwareError
from pneuarm.hardware.transports.modbus import ModbusTerminal, milliseconds_to_registers


@dataclass(frozen=True)
class TerminalWatchdog:
    """Where a terminal keeps its timeout, and what it must do when that has run out.

    ``words`` is 1 on CPX-E and CPX-FB36 (register 46100), 2 on CPX-AP (14000, low word first).
    ``timeout_ms`` 0 leaves the terminal without one. ``failsafe_register`` must read 0, "reset all
    outputs"; None where the terminal does not show it.
    """

    register: int
    words: int
    timeout_ms: int
    failsafe_register: int | None = None

    def set_on(self, terminal: ModbusTerminal, name: str) -> None:
        """Set it and read it back; raises HardwareError where the terminal keeps another value."""
        if self.failsafe_register is not None:
            self._check_failsafe(terminal, name)
        if self.timeout_ms == 0:
            return
        wanted = milliseconds_to_registers(self.timeout_ms, self.words)
        try:
            terminal.write(self.register, wanted)
            found = terminal.read(self.register, self.words)
        except HardwareError as error:
            raise HardwareError(
                f"the terminal's watchdog cannot be set ({error}); check {name}.watchdog_register, "
                f"or set {name}.watchdog_ms = 0 and see hardware.accept_no_watchdog"
            ) from error
        if found != wanted:
            raise HardwareError(
                f"{name}: the terminal's watchdog was set to {wanted} and reads {found} in "
                f"register {self.register}; check {name}.watchdog_register and watchdog_words"
            )

    def check_on(self, terminal: ModbusTerminal, name: str) -> None:
        """Raise HardwareError where the terminal has no longer what it was set to."""
        if self.failsafe_register is not None:
            self._check_failsafe(terminal, name)
        if self.timeout_ms == 0:
            return
        wanted = milliseconds_to_registers(self.timeout_ms, self.words)
        found = terminal.read(self.register, self.words)
        if found != wanted:
            raise HardwareError(
                f"{name}: the terminal's watchdog reads {found} in register {self.register} and "
                f"was set to {wanted}: another program or the terminal's own panel changed it, "
                "and it might have trapped the air when this machine dies; end the other program, "
                "then reset: it is set again at every connection"
            )

    def _check_failsafe(self, terminal: ModbusTerminal, name: str) -> None:
        (found,) = terminal.read(self.failsafe_register or 0, 1)
        if found != 0:
            raise HardwareError(
                f"{name}: the terminal's fail-safe setting reads {found} in register "
                f"{self.failsafe_register}, not 0 (reset all outputs): with 'hold last state' it "
                "traps the air when this machine dies; change it in the terminal"
            )


class KeptWatchdog:
    """The watchdog of one terminal: set with the connection, looked at once a second from then on.

    Anybody on the terminal's network may write its registers.
    """

    EVERY_S = 1.0

    def __init__(self, where: TerminalWatchdog, terminal: ModbusTerminal, name: str) -> None:
        self._where, self._terminal, self._name = where, terminal, name
        self._looked_s: float | None = None

    def set(self) -> None:
        """Set it; raises HardwareError where the terminal keeps another value."""
        self._where.set_on(self._terminal, self._name)
        self._looked_s = None

    def look(self, time_s: float) -> None:
        """Raise HardwareError where it is no longer as it was set; asks once a second."""
        if self._looked_s is None:
            self._looked_s = time_s
        if not 0.0 <= time_s - self._looked_s < self.EVERY_S:
            self._looked_s = time_s
            self._where.check_on(self._terminal, self._name)
