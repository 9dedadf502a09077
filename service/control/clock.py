"""Absolute deadlines, the latency of waking, and the cycles that were missed."""

import time
from dataclasses import dataclass


@dataclass(frozen=True)
class Wake:
    """One waking: when it was due, how late it came (ns), and how many cycles were skipped."""

    due_ns: int
    late_ns: int
    skipped: int


class Clock:
    """Wakes at multiples of the period on the monotonic clock.

    It sleeps to shortly before the deadline and spins the rest: the kernel alone wakes a process
    some 40 us late, spinning brings that below one.
    """

    def __init__(self, rate_hz: float, spin_us: float) -> None:
        self._period_ns = round(1e9 / rate_hz)
        self._spin_ns = round(spin_us * 1e3)
        self._due_ns = time.monotonic_ns()

    def wait(self) -> Wake:
        """Wait for the next deadline. Deadlines that are past already are skipped, and counted."""
        self._due_ns += self._period_ns
        skipped = max(0, (time.monotonic_ns() - self._due_ns) // self._period_ns)
        self._due_ns += skipped * self._period_ns
        self._sleep_until(self._due_ns - self._spin_ns)
        now = time.monotonic_ns()
        while now < self._due_ns:
            now = time.monotonic_ns()
        return Wake(self._due_ns, now - self._due_ns, skipped)

    @staticmethod
    def _sleep_until(until_ns: int) -> None:
        remaining = until_ns - time.monotonic_ns()
        if remaining > 0:
            time.sleep(remaining * 1e-9)
