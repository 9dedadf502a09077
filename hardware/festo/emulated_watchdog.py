"""The watchdog inside an emulated terminal, with both fail-safe settings."""

from pneuarm.hardware.emulation.emulation import EmulatedArm
from pneuarm.hardware.festo.terminal_watchdog import TerminalWatchdog
from pneuarm.hardware.transports.modbus import milliseconds_to_registers


class EmulatedWatchdog:
    """Zeroes the arm, or with ``hold`` only says so, when the host has been silent for too long.

    It begins with the first request of a host, as in the terminals. Its registers are where
    ``where`` says.
    """

    def __init__(self, arm: EmulatedArm, where: TerminalWatchdog, hold: bool) -> None:
        self._arm, self._where, self._hold = arm, where, hold
        self.timeout_ms = where.timeout_ms
        self._touched_s: float | None = None

    def registers(self) -> dict[int, int]:
        """Its time and, where there is one, its fail-safe setting, by register."""
        where = self._where
        words = milliseconds_to_registers(self.timeout_ms, where.words)
        found = {where.register + index: word for index, word in enumerate(words)}
        if where.failsafe_register is not None:
            found[where.failsafe_register] = int(self._hold)
        return found

    def takes(self, address: int, values: list[int]) -> bool:
        """Take its time or its fail-safe setting; False where these are other registers."""
        if address == self._where.failsafe_register and len(values) == 1:
            self._hold = bool(values[0])
            return True
        if address != self._where.register or len(values) != self._where.words:
            return False
        self.timeout_ms = sum(value << (16 * index) for index, value in enumerate(values))
        return True

    def touched(self, now_s: float) -> None:
        """The host has asked for something."""
        self._touched_s = now_s

    def step(self, now_s: float) -> bool:
        """Return whether it runs out now, which it does once a silence."""
        if self._touched_s is None or self.timeout_ms == 0:
            return False
        if now_s - self._touched_s <= self.timeout_ms * 1e-3:
            return False
        self._touched_s = None
        if self._hold:
            self._arm.note(now_s, "watchdog-hold")
            return False
        self._arm.zero_all(now_s, "watchdog")
        return True
