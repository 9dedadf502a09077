"""What the pressures should be by now: the commands through the valves' delay and lag."""

from collections import deque
from math import exp

from pneuarm.controllers.arm.arm import Response


class Lag:
    """``dp/dt = (sent(t - delay) - p) / lag``, exact over steps; from the first measurement on."""

    def __init__(self, response: Response) -> None:
        self._response = response
        self._now_s = 0.0
        self._acting: list[float] = []
        self._newest: list[float] = []
        self._pending: deque[tuple[float, list[float]]] = deque()
        self.expected_pa: list[float] = []

    def advance(self, sent_pa: list[float], measured_pa: list[float], dt_s: float) -> list[float]:
        """Let ``dt_s`` pass under ``sent_pa``; return what is expected now."""
        if not self.expected_pa:
            # A pressure that is not known yet counts as vented.
            self.expected_pa = [value if value == value else 0.0 for value in measured_pa]
            self._acting = self._newest = sent_pa
            return self.expected_pa
        if sent_pa != self._newest:
            self._newest = sent_pa
            self._pending.append((self._now_s + self._response.delay_s, sent_pa))
        until_s = self._now_s + dt_s
        while self._pending and self._pending[0][0] <= until_s:
            due_s, setpoints = self._pending.popleft()
            self._relax_to(due_s)
            self._acting = setpoints
        self._relax_to(until_s)
        return self.expected_pa

    def _relax_to(self, time_s: float) -> None:
        passed_s, self._now_s = time_s - self._now_s, time_s
        if passed_s <= 0.0:
            return
        rest = exp(-passed_s / self._response.lag_s) if self._response.lag_s else 0.0
        self.expected_pa = [
            acting + rest * (expected - acting)
            for acting, expected in zip(self._acting, self.expected_pa, strict=True)
        ]
