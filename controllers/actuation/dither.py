"""A small fast alternation of the setpoints around their values, against stiction and resolution.

A valve that regulates in steps, or sticks until a change is large enough, stands anywhere in
between. Setpoints that swing by more than that make it pass through, and its lag averages the
swing away. All chambers swing together, so that nothing bends.
"""

#: A second, slower swing of half a coarse step spreads the peaks of the first over the resolution.
_SLOWER, _SMALLER = 4.236, 1.0 / 6.0


class Dither:
    """Two triangle waves; ``amplitude_pa`` is that of the first, its period in s."""

    def __init__(self, amplitude_pa: float, period_s: float) -> None:
        self._amplitude_pa, self._period_s = amplitude_pa, period_s

    def at_pa(self, time_s: float) -> float:
        """What is added to every setpoint at a time."""
        if not self._amplitude_pa:
            return 0.0
        phase = time_s / self._period_s
        fast, slow = _triangle(phase), _triangle(phase / _SLOWER)
        return self._amplitude_pa * (fast + _SMALLER * slow)


def _triangle(phase: float) -> float:
    return 4.0 * abs(phase % 1.0 - 0.5) - 1.0
