"""The watchdog inside an emulated terminal, with both fail-safe settings."""

from hardware.emulation import EmulatedArm


class EmulatedWatchdog:
    """Zeroes the arm, or with ``hold`` only says so, when the host has been silent for too long.

    It begins with the first request of a host, as in the terminals.
    """

    def __init__(self, arm: EmulatedArm, timeout_ms: int, hold: bool) -> None:
        self._arm, self._hold = arm, hold
        self.timeout_ms = timeout_ms
        self._touched_s: float | None = None

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
