"""The way down after a fault that need not vent at once."""

import numpy as np

from pneuarm.controllers.arm.arm import Array


class Ramp:
    """All pressures to zero in proportion, none faster than a rate; over after a fixed time.

    In proportion, so that the arm straightens the way it is bent. Only time moves it: whatever the
    device answers, it ends.
    """

    def __init__(self, start_pa: Array, rate_pa_s: float, now_s: float) -> None:
        self._start_pa = np.where(np.isfinite(start_pa), start_pa, 0.0)
        self._begin_s = now_s
        self._duration_s = float(np.abs(self._start_pa).max()) / rate_pa_s

    def over(self, now_s: float) -> bool:
        """Whether zero is reached."""
        return now_s - self._begin_s >= self._duration_s

    def pressures_pa(self, now_s: float) -> Array:
        """Pressures (n_sections, 3) wanted at a time before the end."""
        return self._start_pa * (1.0 - (now_s - self._begin_s) / self._duration_s)
