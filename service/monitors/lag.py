"""What the pressures should be by now: the commands through the valves' first-order lag."""

from math import exp


class Lag:
    """``dp/dt = (sent - p) / T``, exact over each tick; begins at the first measurement."""

    def __init__(self, time_constant_s: float) -> None:
        self._time_constant_s = time_constant_s
        self.expected_pa: list[float] = []

    def advance(self, sent_pa: list[float], measured_pa: list[float], dt_s: float) -> list[float]:
        """Let ``dt_s`` pass under ``sent_pa``; return what is expected now."""
        if not self.expected_pa:
            # A pressure that is not known yet counts as vented.
            self.expected_pa = [value if value == value else 0.0 for value in measured_pa]
            return self.expected_pa
        rest = exp(-dt_s / self._time_constant_s)
        self.expected_pa = [
            sent + rest * (expected - sent)
            for sent, expected in zip(sent_pa, self.expected_pa, strict=True)
        ]
        return self.expected_pa
